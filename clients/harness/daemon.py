"""A private bounced, and frames from it.

    with Daemon() as daemon:
        frame = daemon.render("box.glb", "rsm", {"vpls": 64}, size=(64, 64))
        frame.layer("indirect")          # height x width x 3

The executables are those of $BOUNCE and $BOUNCED; else they are looked for on PATH. One daemon
serves many frames; one that dies is noticed, counted, its last words are kept, and the next frame
gets a new one.
"""
import dataclasses
import json
import os
import shlex
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from pathlib import Path

from . import exr

START_SECONDS = 60
FRAME_SECONDS = 120
EXIT_DEVICE = 6
CHOICES = {"budget_ms": "--budget-ms"}  # settings that are no parameters
JUDGED_HERE = ("--fail-on", "none")  # flags are for who asked to judge: some inputs are meant to be black


class RenderError(Exception):
    """bounce refused or failed. `code` is its exit code, `command` what reproduces it."""

    def __init__(self, message, command, code=None):
        super().__init__(message)
        self.command = command
        self.code = code


class DaemonDied(RenderError):
    """The daemon ended while it rendered; a new one was started."""


class RenderTimeout(RenderError):
    """No picture within the time; the daemon was ended and started anew."""


class NoDevice(Exception):
    """Nothing to render on: for a test the one reason to be skipped."""


@dataclasses.dataclass
class Frame:
    planes: dict   # by EXR channel name, height x width float32
    report: dict   # interface.md's report
    strings: dict  # the EXR's string attributes
    command: str   # what made it, for a shell

    def layer(self, name="beauty"):
        """height x width x 3."""
        return exr.layer(self.planes, name)

    def has(self, name):
        return name == "beauty" or f"{name}.R" in self.planes


def program(variable, name):
    """The executable that an environment variable names, or the one on PATH."""
    found = os.environ.get(variable) or shutil.which(name)
    if not found:
        raise SystemExit(f"no {name}: set {variable} to its path")
    return str(found)


def cache_folder(name):
    """The user's cache folder for `name`; made when something is kept there."""
    home = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(home) / "bounced" / name


def _driver_caches():
    """Compiled shaders outlive the daemon's folder: compiling them anew is half of a short run."""
    folder = cache_folder("shaders")
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError:
        return {}
    return {name: str(folder) for name in ("MESA_SHADER_CACHE_DIR", "__GL_SHADER_DISK_CACHE_PATH")}


class Daemon:
    """Use as a context: it ends the process and removes its folder, after Ctrl-C too.

    `deaths` counts daemons that ended by themselves. `folder` is there for scenes to be rendered.
    """

    def __init__(self, device=None, arguments=(), timeout_s=FRAME_SECONDS):
        self.bounce = program("BOUNCE", "bounce")
        self.bounced = program("BOUNCED", "bounced")
        self.timeout_s = timeout_s
        self.deaths = 0
        self._arguments = [*(("--device", device) if device else ()), *map(str, arguments)]
        self._process = None
        self._serial = 0

    def __enter__(self):
        self.folder = Path(tempfile.mkdtemp(prefix="bounce-"))
        self.env = {**_driver_caches(), **os.environ, "XDG_RUNTIME_DIR": str(self.folder)}
        self.log = self.folder / "bounced.log"
        try:
            self._start()
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *_):
        self._stop()
        shutil.rmtree(self.folder, ignore_errors=True)

    @property
    def url(self):
        return f"unix:{self.folder}/bounced.sock"

    @property
    def pid(self):
        return self._process.pid

    def _start(self):
        words = [self.bounced, "--http", "none", "--listen", self.url,
                 "--data", str(self.folder / "data"), *self._arguments]
        with open(self.log, "ab") as log:
            self._log_start = log.tell()
            # A group of its own: Ctrl-C is for us, who then end it in order.
            self._process = subprocess.Popen(words, stderr=log, stdout=log, env=self.env,
                                             stdin=subprocess.DEVNULL, start_new_session=True)
        deadline = time.monotonic() + START_SECONDS
        while not self._listens():
            if self._process.poll() == EXIT_DEVICE:
                raise NoDevice(self.last_words())
            if self._process.poll() is not None or time.monotonic() > deadline:
                raise RuntimeError(f"bounced does not listen: {self.last_words()}")
            time.sleep(0.01)

    def _listens(self):
        """A socket is in its folder a moment before anybody listens to it."""
        with socket.socket(socket.AF_UNIX) as peer:
            return peer.connect_ex(str(self.folder / "bounced.sock")) == 0

    def _stop(self):
        if self._process and self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(timeout=20)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()
        (self.folder / "bounced.sock").unlink(missing_ok=True)

    def restart(self):
        self._stop()
        self._start()

    def last_words(self, lines=12):
        """The end of the log of the daemon that runs, or ran last."""
        text = self.log.read_bytes()[self._log_start:].decode(errors="replace")
        return "\n".join(text.splitlines()[-lines:])

    def _end_text(self):
        code = self._process.returncode
        return signal.Signals(-code).name if code < 0 else f"exit code {code}"

    def command(self, scene, technique, settings=None, size=(64, 64), camera=None,
                layers=("beauty",), seed=0, aa=1, extra=(), output="frame.exr"):
        """The words of `bounce render` without a server: what a person types to see it."""
        words = ["bounce", "render", str(scene), "-o", str(output), "--technique", technique,
                 "--size", f"{size[0]}x{size[1]}", "--layers", ",".join(layers),
                 "--seed", str(seed), "--aa", str(aa)]
        if output is None:
            del words[3:5]
        for key, value in (settings or {}).items():
            words += [CHOICES[key], value] if key in CHOICES else ["--set", f"{key}={value}"]
        if camera is not None:
            words += ["--camera", str(camera)]
        return [*words, *map(str, extra)]

    def hold(self, scene):
        """Gives the daemon a scene: its answer. "scene:" and the id render it without an import."""
        self._revive()
        words = ["scene", "add", str(scene), "--json", "--quiet"]
        shown = shlex.join(["bounce", *words])
        return json.loads(self._run([self.bounce, *words, "--server", self.url], shown,
                                    self.timeout_s))

    def report(self, scene, technique, settings=None, size=(64, 64), camera=None,
               layers=("beauty",), seed=0, aa=1, extra=(), timeout_s=None):
        """What a frame cost: it is rendered and read back, but not encoded."""
        self._revive()
        words = self.command(scene, technique, settings, size, camera, layers, seed, aa,
                             (*extra, "--json"), None)
        asked = [self.bounce, *words[1:], *JUDGED_HERE, "--quiet", "--server", self.url]
        return json.loads(self._run(asked, shlex.join(words), timeout_s or self.timeout_s))

    def _revive(self):
        """A new daemon if the old one died between two frames."""
        if self._process.poll() is not None:
            self.deaths += 1
            self.restart()

    def render(self, scene, technique, settings=None, size=(64, 64), camera=None,
               layers=("beauty", "direct", "indirect", "emission"), seed=0, aa=1, extra=(),
               timeout_s=None, keep=None):
        """One frame; its file also goes to `keep`. Whatever is raised names the command."""
        self._revive()
        self._serial += 1
        output = self.folder / f"frame{self._serial}.exr"
        report = output.with_suffix(".json")
        words = self.command(scene, technique, settings, size, camera, layers, seed, aa, extra,
                             output)
        shown = shlex.join(self.command(scene, technique, settings, size, camera, layers, seed, aa,
                                        extra))
        words = [self.bounce, *words[1:], *JUDGED_HERE, "--quiet", "--report", str(report), "--server", self.url]
        try:
            self._run(words, shown, timeout_s or self.timeout_s)
            planes, strings = exr.read(output.read_bytes())
            if keep:
                shutil.copyfile(output, keep)
            return Frame(planes, json.loads(report.read_text()), strings, shown)
        finally:
            output.unlink(missing_ok=True)
            report.unlink(missing_ok=True)

    def _run(self, words, shown, timeout_s):
        """Standard output of a bounce that ended well."""
        try:
            result = subprocess.run(words, env=self.env, capture_output=True, timeout=timeout_s,
                                    check=False)
        except subprocess.TimeoutExpired:
            self._process.kill()  # whoever hangs in a frame ends no better when asked
            self.restart()
            raise RenderTimeout(f"no picture within {timeout_s} s", shown) from None
        if result.returncode == 0:
            return result.stdout
        self._await_death()
        if self._process.poll() is not None:
            self.deaths += 1
            message = f"bounced died ({self._end_text()}): {self.last_words()}"
            self.restart()
            raise DaemonDied(message, shown, result.returncode)
        raise RenderError(result.stderr.decode(errors="replace").strip(), shown, result.returncode)

    def _await_death(self):
        """bounce sees the socket close a moment before the process is gone."""
        try:
            self._process.wait(timeout=0.3)
        except subprocess.TimeoutExpired:
            pass
