"""One judgement a line: technique x row x scene, a state, a figure against its tolerance.

    technique  relation     scene    state  figure     tolerance
    rsm        light_power  workshop pass   0          1e-06      2^-30
"""
import dataclasses
import json
import sys

PASS, FLAGGED, FAIL, SKIP = "pass", "flagged", "FAIL", "skip"


@dataclasses.dataclass(frozen=True)
class Verdict:
    technique: str
    row: str            # relation, oracle or hazard
    scene: str          # or view
    state: str
    figure: float = float("nan")
    tolerance: float = float("nan")
    note: str = ""
    command: str = ""   # reproduces it, for a shell


def judged(technique, row, scene, figure, tolerance, note="", command=""):
    """Passes when the figure is at most the tolerance; NaN never is."""
    state = PASS if figure <= tolerance else FAIL
    return Verdict(technique, row, scene, state, figure, tolerance, note, command)


def _number(value):
    return "" if value != value else f"{value:.3g}"


class Table:
    """Prints each verdict when it is known, and what failed once more at the end."""

    COLUMNS = (12, 20, 22, 5, 9, 9)

    def __init__(self, row_name, scene_name, as_json=False):
        self.verdicts = []
        self._json = as_json
        self._print(("technique", row_name, scene_name, "state", "figure", "at most", ""))

    def _print(self, words):
        if self._json:
            return
        cells = [f"{word:<{width}}" for word, width in zip(words, self.COLUMNS)]
        print("  ".join([*cells, words[-1]]).rstrip(), flush=True)

    def add(self, verdict):
        self.verdicts.append(verdict)
        self._print((verdict.technique, verdict.row, verdict.scene, verdict.state,
                     _number(verdict.figure), _number(verdict.tolerance), verdict.note))

    def count(self, state):
        return sum(verdict.state == state for verdict in self.verdicts)

    def finish(self):
        """Prints the failures with their commands and the sum; the exit code."""
        failures = [verdict for verdict in self.verdicts if verdict.state == FAIL]
        if self._json:
            json.dump([dataclasses.asdict(verdict) for verdict in self.verdicts], sys.stdout,
                      indent=1, default=str)
            print()
        for verdict in failures:
            print(f"FAIL {verdict.technique} {verdict.row} {verdict.scene}: {verdict.note}\n"
                  f"     {verdict.command}", file=sys.stderr)
        if not self._json:
            print(", ".join(f"{self.count(state)} {word}" for state, word in
                            ((PASS, "passed"), (FLAGGED, "flagged"), (FAIL, "failed"),
                             (SKIP, "skipped"))))
        return 1 if failures or not self.verdicts else 0
