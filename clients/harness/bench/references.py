"""References, made once and kept: by scene, options and samples.

A file's name is a digest of all that decides its pixels but the number of samples; what it holds is
checked against its own manifest before it is believed. The daemon's program is part of it: one of the
same version that was built anew may trace otherwise. Where more samples are wanted than it has, it
is extended, not begun again. All references of a run share one seed: noise that two of them have in
common drops out of their difference, and each still has two halves that have none.
"""
import dataclasses
import hashlib
import shlex
import signal
import subprocess
import time
from pathlib import Path

from .. import exr
from ..daemon import RenderError, program
from .measure import digest
from .rungs import noise
from .store import settings_text

SEED = 7243529  # unlike any that --seed would be given, so that no picture shares its samples
SPP_FIRST, SPP_MAX = 64, 1 << 20
STOP_SECONDS = 60


@dataclasses.dataclass
class Reference:
    scene: object  # the scene's path
    path: object   # the EXR file
    planes: dict
    spp: int
    settings: dict
    seconds: float  # spent on it now; 0 where it was there

    def summary(self):
        layers = {layer: noise(self.planes, layer) for layer in ("beauty", "indirect")}
        return {"file": self.path.name, "settings": settings_text(self.settings), "spp": self.spp,
                "seed": SEED, "noise": layers, "seconds": self.seconds}


class References:
    """`common` is what every picture of the run is rendered with as well: brdf=lambert."""

    def __init__(self, stage, folder, common, spp, error, say=lambda line: None):
        self.stage = stage
        self.folder = folder
        self.common = common
        self.spp = spp
        self.error = error  # largest noise of beauty, as a ratio; None: `spp` it is
        self.say = say
        self.made = {}
        self.program = hashlib.sha256(Path(program("BOUNCED", "bounced")).read_bytes()).hexdigest()
        folder.mkdir(parents=True, exist_ok=True)

    def get(self, path, settings):
        """The reference of a scene for the settings of an integrand."""
        settings = {**self.common, **settings}
        file = self._file(path, settings)
        if file not in self.made:
            self.made[file] = self._sampled(path, file, settings)
        return self.made[file]

    def held(self, path, settings):
        """The same if it need not be traced now; None otherwise."""
        settings = {**self.common, **settings}
        file = self._file(path, settings)
        return self.made.get(file) or self._read(file, path, settings)

    def _file(self, path, settings):
        scene = self.stage.scene(path)
        key = digest(scene.hash, settings_text(dict(sorted(settings.items()))), self.stage.size,
                     self.stage.camera or "", SEED, self.program)
        return self.folder / f"{scene.name}-{key}.exr"

    def _sampled(self, path, file, settings):
        start = time.monotonic()
        found = self._read(file, path, settings)
        spp = self.spp if self.error is None else max(SPP_FIRST, found.spp if found else 0)
        while True:
            if not found or found.spp < spp:
                found = self._trace(path, file, settings, spp)
                found.seconds = time.monotonic() - start
            if self.error is None or (noise(found.planes, "beauty") or 0.0) <= self.error:
                return found
            if spp >= SPP_MAX:
                raise RenderError(f"reference: noise still above {self.error:g} at {spp} samples",
                                  str(file))
            spp *= 2

    def _read(self, file, path, settings):
        """What the cache holds, if it is what its name says."""
        try:
            planes, strings = exr.read(file.read_bytes())
        except (OSError, ValueError, AssertionError, KeyError, IndexError):
            return None
        said = dict(word.split("=", 1) for word in strings.get("parameters", "").split())
        width, height = self.stage.size
        plan = self._plan(path, settings)
        matches = (strings.get("scene") == self.stage.scene(path).hash
                   and strings.get("technique") == "reference"
                   and strings.get("build") == plan["build"]
                   and strings.get("seed") == str(SEED)
                   and planes["R"].shape == (height, width)
                   and said.get("spp", "").isdigit()
                   and _integrand(said) == _integrand(plan["parameters"]))
        return Reference(path, file, planes, int(said["spp"]), settings, 0.0) if matches else None

    def _plan(self, path, settings):
        """Every parameter that the settings come to, and who would trace it."""
        return self.stage.ask(self.stage.daemon.report, path, "reference", settings,
                              extra=("--plan",))

    def _words(self, path, file, settings, spp):
        words = ["reference", str(path), "-o", str(file), "--spp", str(spp), "--seed", str(SEED),
                 "--size", "x".join(map(str, self.stage.size)), "--quiet"]
        if self.stage.camera is not None:
            words += ["--camera", self.stage.camera]
        for key, value in settings.items():
            words += ["--set", f"{key}={value}"]
        return words

    def filtered(self, reference, file):
        """The planes of a file that has all but the light of `reference`, behind the filter of noise."""
        daemon = self.stage.daemon
        words = self._words(reference.scene, file, {**self.common, **reference.settings}, reference.spp)
        code, errors = _interruptible([daemon.bounce, *words, "--filter-noise", "--server", daemon.url], daemon.env)
        if code:
            raise RenderError(f"filter: {errors.strip()}", shlex.join(["bounce", *words]), code)
        return exr.read(file.read_bytes())[0]

    def _trace(self, path, file, settings, spp):
        """Has `bounce reference` write the file, or go on with the one that is there."""
        daemon = self.stage.daemon
        words = self._words(path, file, settings, spp)
        if file.exists() and not self._read(file, path, settings):
            words.append("--force")  # it is not what its name says
        self.say(f"{path.stem}: reference {settings_text(settings)}".rstrip()
                 + f", {spp} samples a pixel")
        code, errors = _interruptible([daemon.bounce, *words, "--server", daemon.url], daemon.env)
        found = self._read(file, path, settings) if code == 0 else None
        if not found:
            said = errors.strip() or "its file does not say that it is what was asked for"
            raise RenderError(f"reference: {said}", shlex.join(["bounce", *words]), code)
        return found


def _integrand(parameters):
    """Without what counts samples, and with numbers as such: "4" and 4.0 are the same."""
    def value(text):
        try:
            return float(text)
        except ValueError:
            return text
    return {k: value(v) for k, v in parameters.items() if k not in ("spp", "first_sample")}


def _interruptible(words, env):
    """Exit code and standard error. An interruption is passed on once, and waited for: the command
    then writes what it has."""
    process = subprocess.Popen(words, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
                               env=env, start_new_session=True)
    try:
        _, errors = process.communicate()
    except KeyboardInterrupt:
        process.send_signal(signal.SIGINT)
        try:
            process.communicate(timeout=STOP_SECONDS)
        except subprocess.TimeoutExpired:
            process.kill()
            process.communicate()
        raise
    return process.returncode, errors
