"""The command `bounce` of a build, for scripts that compare files which it writes."""
import json
import re
import subprocess
import sys
from pathlib import Path

from harness.bench.store import machine


def name_of(case):
    """Of SCENE or SCENE@SKY."""
    return "@".join(Path(word).stem for word in case.split("@"))


def write(out, script, rows):
    """A result: what made it, by the names of its files alone, where, and its rows."""
    words = [name_of(word) if word.rsplit(".", 1)[-1] in ("glb", "exr") else word for word in sys.argv[2:]]
    command = " ".join([f"tests/bench/{script}", "BUILD", *words])
    for option, value in (("-o", "RESULT.json"), ("--truths", "FOLDER")):
        command = re.sub(rf"{option} \S+", f"{option} {value}", command)
    out.write_text(json.dumps({"command": command, "machine": machine(), "rows": rows}, indent=1) + "\n")


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
