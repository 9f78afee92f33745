"""How long something took, and how much of that our own processes needed.

"Ends within two seconds" is said of the code. On a busy machine processes wait for a processor that others
have; the kernel counts that (schedstat, run delay), and `own_s` leaves it out. So a bound on `own_s` is a tight
one on an idle machine and none that a busy one breaks. What is slow because it sleeps or waits for a lock counts
in full. A lower bound ("not before its second is over") is one on `wall_s`.
"""
import os
import pathlib
import threading
import time
import weakref

# Processes that end take what they waited with them: it is read this often while they live.
SAMPLE_S = 0.1
PROC = pathlib.Path("/proc")

_samplers = set()  # threads that take the samples, by number


def _parents():
    """{process: its parent} of everything that runs."""
    parents = {}
    for entry in filter(str.isdigit, os.listdir(PROC)):
        try:
            stat = (PROC / entry / "stat").read_text(encoding="utf-8", errors="replace")
            parents[int(entry)] = int(stat[stat.rindex(")") + 2:].split()[1])
        except (OSError, ValueError, IndexError):
            pass  # gone meanwhile
    return parents


def _our_threads():
    """Those of this process and of all that it started, as folders of /proc; not who samples them."""
    parents, own = _parents(), os.getpid()

    def is_ours(pid):
        while pid and pid != own:
            pid = parents.get(pid)
        return pid == own

    for pid in filter(is_ours, parents):
        try:
            for task in (PROC / str(pid) / "task").iterdir():
                if task.name not in _samplers:
                    yield task
        except OSError:
            pass  # gone meanwhile


class _Delays:
    """For how long each thread could have run and did not, of those that ended, too."""

    def __init__(self):
        self.by_thread_s = {}
        self.lock = threading.Lock()

    def sample(self):
        for task in _our_threads():
            try:
                delay_s = int((task / "schedstat").read_text().split()[1]) * 1e-9
            except (OSError, ValueError, IndexError):
                continue  # gone, or a kernel that does not count: then the bound is one on wall time
            with self.lock:
                self.by_thread_s[task.name] = delay_s

    def total_s(self):
        self.sample()
        with self.lock:
            return sum(self.by_thread_s.values())


def _keep_sampling(delays, ended):
    _samplers.add(str(threading.get_native_id()))
    while not ended.wait(SAMPLE_S):
        delays.sample()


class Stopwatch:
    """Runs from its making on; may be read again and again."""

    def __init__(self):
        self._delays = _Delays()
        self._before_s = self._delays.total_s()
        ended = threading.Event()
        weakref.finalize(self, ended.set)
        threading.Thread(target=_keep_sampling, args=(self._delays, ended), daemon=True).start()
        self._begin = time.monotonic()

    def wall_s(self):
        return time.monotonic() - self._begin

    def own_s(self):
        """At least zero. Threads that waited side by side are counted one by one: it errs on the short side."""
        wall_s = self.wall_s()
        return max(0, wall_s - (self._delays.total_s() - self._before_s))
