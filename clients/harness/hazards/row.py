"""What a hazard is to the harness, and how one is run on a technique."""
import dataclasses
import time
from collections.abc import Callable

from ..daemon import DaemonDied, RenderError, RenderTimeout

ROWS = {}  # by number


class NotApplicable(Exception):
    """Why a row has no answer for a technique."""


class Failure(Exception):
    """An answer that does not hold. `command` made the picture."""

    def __init__(self, expected, seen, command):
        super().__init__(f"expected {expected}, saw {seen}")
        self.expected, self.seen, self.command = expected, seen, command


@dataclasses.dataclass(frozen=True)
class Row:
    number: int
    title: str
    codes: str  # of the techniques it concerns: "" for all, else letters of "TNSIPR"
    check: Callable | None = None
    unit_test: str | None = None  # "tests/FILE:name" that holds what no picture can show

    def concerns(self, technique, extra_codes=""):
        codes = technique.hazard_codes + extra_codes + ("R" if technique.is_reference else "")
        return not self.codes or any(code in self.codes for code in codes)


@dataclasses.dataclass
class Outcome:
    row: int
    technique: str
    status: str  # pass | flag | FAIL | -
    note: str = ""  # the flags, or why it does not apply
    expected: str = ""
    seen: str = ""
    command: str = ""
    seconds: float = 0.0


def row(number, title, codes=""):
    """Registers the function below as the check of a row; `codes` as in the table, R for the
    reference."""
    def register(check):
        assert number not in ROWS, number
        ROWS[number] = Row(number, title, codes, check)
        return check
    return register


def unit_row(number, title, codes, unit_test=None):
    """A row about numbers inside a stage. Whoever declares one of its codes must have written the
    test and named it here."""
    assert number not in ROWS, number
    ROWS[number] = Row(number, title, codes, unit_test=unit_test)


def _inner(row_, technique):
    """The outcome of a row that no picture can show."""
    if row_.unit_test:
        return Outcome(row_.number, technique.name, "-", f"held by {row_.unit_test}")
    return Outcome(row_.number, technique.name, "FAIL",
                   expected="a unit test, named in clients/harness/hazards/units.py",
                   seen=f"none, though {technique.name} declares one of {row_.codes}")


def _without_stage(row_, technique):
    letters = ", ".join("reference" if code == "R" else code for code in row_.codes)
    note = f"concerns {letters} alone"
    if row_.check is None and not row_.unit_test:
        note = f"about a stage that no technique has yet ({letters})"
    return Outcome(row_.number, technique.name, "-", note)


def _answered(case):
    """Runs the check; every way to go wrong becomes an outcome."""
    number, name = case.row.number, case.technique.name
    try:
        case.row.check(case)
    except NotApplicable as reason:
        return Outcome(number, name, "-", str(reason))
    except Failure as fault:
        return Outcome(number, name, "FAIL", expected=fault.expected, seen=fault.seen,
                       command=fault.command)
    except (DaemonDied, RenderTimeout, RenderError) as fault:
        return Outcome(number, name, "FAIL", expected="a picture", seen=str(fault),
                       command=fault.command)
    status = "flag" if case.flags else "pass"
    return Outcome(number, name, status, "; ".join([*case.flags, *case.notes]))


def run(row_, case, extra_codes="", own_stages_alone=False):
    technique = case.technique
    if own_stages_alone and not row_.codes:
        return Outcome(row_.number, technique.name, "-", "of techniques for comparison only those "
                       "of their own stages, unless named or with --size full")
    if not row_.concerns(technique, extra_codes):
        return _without_stage(row_, technique)
    if row_.check is None:
        return _inner(row_, technique)
    start = time.monotonic()
    outcome = _answered(case)
    outcome.seconds = time.monotonic() - start
    outcome.command = case.shown(outcome.command)
    return outcome
