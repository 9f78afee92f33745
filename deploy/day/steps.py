"""Runs the steps of a leg, some side by side, until they are done or the leg's time is up.

A step is {"name", "suite", "words", "environment", "seconds", "alone"} and may have "goes_on" and
"ends" (legs.py). Its outcome is the same with "result", "took_s" and, where it did not pass, the end
of what it said. Results: passed, failed, skipped (exit code 77), late (took longer than its own
time), cut (the leg's time was up while it ran; what goes on has kept what it had), not run.
"""
import collections
import os
import signal
import subprocess
import threading
import time

SKIPPED = 77
TAIL_BYTES = 4000
INTERRUPT_S = 15  # what an interrupted step has to write down what it knows


class Runner:
    """`changed` is called after every step, from one thread at a time."""

    def __init__(self, steps, logs, environment, seconds, width, changed=lambda outcomes: None):
        self.waiting = collections.deque(steps)
        self.outcomes = {step["name"]: {**_public(step), "result": "not run"} for step in steps}
        self.logs, self.environment, self.width, self.changed = logs, environment, width, changed
        self.ends_at = time.monotonic() + seconds
        self.lock = threading.Lock()

    def run(self):
        """Those that may have others beside them first, then one at a time."""
        together = collections.deque(s for s in self.waiting if not s["alone"])
        alone = collections.deque(s for s in self.waiting if s["alone"])
        for steps, width in ((together, self.width), (alone, 1)):
            threads = [threading.Thread(target=self._work, args=(steps,)) for _ in range(width)]
            for thread in threads:
                thread.start()
            for thread in threads:
                thread.join()
        return list(self.outcomes.values())

    def _work(self, steps):
        while time.monotonic() < self.ends_at:
            try:
                step = steps.popleft()
            except IndexError:
                return
            outcome = self._one(step)
            with self.lock:
                self.outcomes[step["name"]].update(outcome)
                self.changed(list(self.outcomes.values()))

    def _one(self, step):
        start = time.monotonic()
        path = self.logs / f"{step['name']}.txt"
        with open(path, "wb") as log:
            try:
                process = subprocess.Popen(step["words"], stdin=subprocess.DEVNULL, stdout=log,
                                           stderr=subprocess.STDOUT, start_new_session=True,
                                           env={**self.environment, **step["environment"]})
            except OSError as fault:
                return {"result": "failed", "took_s": 0.0, "said": str(fault)}
            result = self._wait(process, step, start)
        outcome = {"result": result, "took_s": round(time.monotonic() - start, 2)}
        return outcome if result == "passed" else {**outcome, "said": _tail(path)}

    def _wait(self, process, step, start):
        own_end = start + step["seconds"]
        try:
            code = process.wait(max(0, min(own_end, self.ends_at) - time.monotonic()))
        except subprocess.TimeoutExpired:
            _end(process, step.get("goes_on", False))
            return "late" if own_end <= self.ends_at else "cut"
        finally:
            _signal(process, signal.SIGKILL)  # what it left behind
        if code == SKIPPED:
            return "skipped"
        return "passed" if code == 0 or code in step.get("ends", ()) else "failed"


def _public(step):
    return {name: step[name] for name in ("name", "suite", "words")}


def _signal(process, number):
    try:
        os.killpg(process.pid, number)
    except ProcessLookupError:
        pass


def _end(process, goes_on):
    if goes_on:
        # To it alone, as its own children are its to end.
        process.send_signal(signal.SIGINT)
        try:
            process.wait(INTERRUPT_S)
            return
        except subprocess.TimeoutExpired:
            pass
    _signal(process, signal.SIGKILL)
    process.wait()


def _tail(path):
    with open(path, "rb") as file:
        file.seek(max(0, os.path.getsize(path) - TAIL_BYTES))
        return file.read().decode(errors="replace")
