"""A daemon of one's own over a socket pair: found, started and seen off as `bounce` does it."""
from __future__ import annotations

import os
import shutil
import signal
import socket
import subprocess
from pathlib import Path

from .errors import Error, Unreachable

# Beside the package in a bundle or an installation, or where a build tree has it.
_PLACES = ("../../../bin/bounced", "../../server/bounced")
_EXIT_CODES = {2: "usage", 6: "device"}


def find_daemon() -> str:
    """The executable: $BOUNCED, else near this package, else on PATH."""
    named = os.environ.get("BOUNCED")
    if named:
        if os.access(named, os.X_OK):
            return named
        raise Unreachable(f"$BOUNCED, {named}: no executable", "BOUNCED")
    folder = Path(__file__).absolute().parent.parent
    for place in _PLACES:
        path = os.path.normpath(folder / place)
        if os.access(path, os.X_OK) and os.path.isfile(path):
            return path
    found = shutil.which("bounced")
    if found:
        return found
    raise Unreachable("no bounced to start lies near this package or on PATH; name it by $BOUNCED",
                      "BOUNCED")


class PrivateDaemon:
    """A child process that serves the one socket `sock`, and ends when that is closed."""

    def __init__(self, device: str | None = None, limits: dict[str, int] | None = None,
                 options: tuple[str, ...] = ()) -> None:
        ours, theirs = socket.socketpair()
        words = [find_daemon(), "--private", str(theirs.fileno())]
        for name, value in {"reply_bytes": (1 << 32) - 1, **(limits or {})}.items():
            words += ["--limit", f"{name}={value}"]
        if device is not None:
            words += ["--device", device]
        try:
            # A group of its own, so that the terminal's Ctrl-C reaches us alone; standard output
            # is for results.
            self._process = subprocess.Popen([*words, *options], stdin=subprocess.DEVNULL,
                                             stdout=2, pass_fds=(theirs.fileno(),),
                                             process_group=0)
        except OSError as error:
            ours.close()
            raise Unreachable(f"cannot start {words[0]}: {error.strerror or error}",
                              "BOUNCED") from error
        finally:
            theirs.close()
        self.sock = ours

    @property
    def pid(self) -> int:
        return self._process.pid

    def end(self, patience_s: float = 5) -> int:
        """Waits for its end once `sock` is closed: the exit status, negative for a signal."""
        for say_goodbye in (None, self._process.terminate):
            if say_goodbye:
                say_goodbye()
            try:
                return self._process.wait(patience_s)
            except subprocess.TimeoutExpired:
                continue
        self._process.kill()
        return self._process.wait()

    def reason(self) -> Error:
        """Why it went away. Its exit code says more than the silence."""
        status = self.end()
        if status < 0:
            return Unreachable(f"the private daemon was ended by signal {-status} "
                               f"({signal.Signals(-status).name})", "server")
        return Error(f"the private daemon ended with code {status}; its reason is on standard "
                     "error", "server", _EXIT_CODES.get(status, "unreachable"))
