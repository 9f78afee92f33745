"""The command `bounce` of a build, for scripts that compare files which it writes."""
import json
import subprocess


class Failed(SystemExit):
    pass


class Bounce:
    def __init__(self, build):
        self.program = build / "clients/cli/bounce"
        self.environment = {"PATH": f"{build / 'server'}:/usr/bin:/bin"}

    def __call__(self, *words):
        done = subprocess.run([self.program, *map(str, words)], env=self.environment, capture_output=True, text=True)
        if done.returncode:
            raise Failed(f"bounce {words[0]}: {done.stderr.strip()}")
        return done.stdout

    def off(self, truth, picture, layer):
        """Relative RMSE and the mean's error, both in per cent; None where the truth has no such light."""
        told = json.loads(self("compare", "--json", "-q", truth, picture, "--layer", layer))
        values = [told[name]["value"] for name in ("rel_rmse", "signed_error")]
        return None if None in values else [100 * value for value in values]
