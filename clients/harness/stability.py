"""bounce stability [OPTIONS]: every registered technique through the hazards of algorithms.md, C.

    --technique NAME   this one alone; repeatable
    --row N            this hazard alone; repeatable
    --size small|full  full: more scales, the largest pictures (minutes)
    --codes LETTERS    also the rows of these codes (T N S I P), whatever a technique declares
    --keep DIR         leaves the scenes there, as rowNN-*.glb
    --json             the table as JSON on standard output
    --list             the rows, their codes and where those are held that no picture shows
    --device SPEC      of the private daemon: auto, software, egl:N, ...
    --relations, --oracles  other tests of every technique; --help behind them says more

Prints pass, flag (rendered, and the report says what was repaired), FAIL or - for each technique
and row, then what was expected and seen and the commands that show it again. Exit code: 0 if
nothing failed, 1 otherwise.
"""
import argparse
import dataclasses
import json
import sys
from pathlib import Path

from . import techniques
from .daemon import Daemon
from .hazards import ROWS
from .hazards.case import Case
from .hazards.row import run

FRAME_SECONDS = {"small": 120, "full": 600}


def _words(words):
    parser = argparse.ArgumentParser(prog="bounce stability", description=__doc__,
                                     formatter_class=argparse.RawDescriptionHelpFormatter,
                                     usage=argparse.SUPPRESS, add_help=True)
    parser.add_argument("--technique", action="append", default=[], help=argparse.SUPPRESS)
    parser.add_argument("--row", action="append", default=[], type=int, help=argparse.SUPPRESS)
    parser.add_argument("--size", choices=("small", "full"), default="small",
                        help=argparse.SUPPRESS)
    parser.add_argument("--codes", default="", help=argparse.SUPPRESS)
    parser.add_argument("--keep", type=Path, help=argparse.SUPPRESS)
    parser.add_argument("--device", help=argparse.SUPPRESS)
    parser.add_argument("--json", action="store_true", help=argparse.SUPPRESS)
    parser.add_argument("--list", action="store_true", help=argparse.SUPPRESS)
    options = parser.parse_args(words)
    unknown = sorted(set(options.row) - set(ROWS))
    if unknown:
        parser.error(f"--row {unknown[0]}: rows are 1 to {max(ROWS)}")
    if set(options.codes) - set("TNSIP"):
        parser.error(f"--codes {options.codes}: letters of TNSIP")
    return options


def _list_rows():
    for number in sorted(ROWS):
        row = ROWS[number]
        where = "" if row.check else f"  [{row.unit_test or 'no stage yet'}]"
        print(f"{number:3}  {row.codes or 'all':5} {row.title}{where}")


def _rows(options):
    return [ROWS[number] for number in sorted(ROWS) if not options.row or number in options.row]


def outcomes(daemon, options, folder, progress=lambda row: None):
    """Runs all; a generator of (row, outcomes of all techniques)."""
    chosen = techniques.chosen(daemon, options.technique)
    full = options.size == "full"
    for row in _rows(options):
        progress(row)
        yield row, [run(row, Case(daemon, technique, row, folder, full), options.codes,
                        own_stages_alone=technique.for_comparison and
                        not (full or options.technique or options.row))
                    for technique in chosen]


# --- what is printed ---

def _print_line(row, results):
    cells = "".join(f"{outcome.status:10}" for outcome in results)
    notes = "; ".join(f"{outcome.technique}: {outcome.note}" for outcome in results
                      if outcome.note and outcome.status in ("pass", "flag"))
    print(f"{row.number:3}  {row.title:38} {cells}{notes}".rstrip(), flush=True)


def _print_reasons(results):
    reasons = {}
    for outcome in results:
        if outcome.status == "-":
            reasons.setdefault((outcome.technique, outcome.note), []).append(str(outcome.row))
    for (technique, note), rows in reasons.items():
        print(f"- {technique} {' '.join(rows)}: {note}")


def _print_failure(outcome):
    print(f"\nFAIL {outcome.technique}, row {outcome.row}, {ROWS[outcome.row].title}\n"
          f"  expected  {outcome.expected}\n  saw       {outcome.seen}\n"
          f"  again     bounce stability --technique {outcome.technique} --row {outcome.row}"
          " --keep DIR")
    if outcome.command:
        print(f"            {outcome.command}")


def _print_table(groups, options):
    results = []
    for row, group in groups:
        if not results:
            print(" " * 44 + "".join(f"{outcome.technique:10}" for outcome in group))
        _print_line(row, group)
        results += group
    _print_reasons(results)
    for outcome in results:
        if outcome.status == "FAIL":
            _print_failure(outcome)
    counts = {status: sum(o.status == status for o in results)
              for status in ("pass", "flag", "FAIL", "-")}
    print("\n" + ", ".join(f"{count} {status}" for status, count in counts.items()))
    return results


def _print_json(results):
    rows = [{"row": number, "title": ROWS[number].title, "codes": ROWS[number].codes}
            for number in sorted({outcome.row for outcome in results})]
    text = {"rows": rows, "results": [dataclasses.asdict(outcome) for outcome in results]}
    json.dump(text, sys.stdout, indent=2)
    print()


def main(words, make_daemon=Daemon):
    options = _words(words)
    if options.list:
        _list_rows()
        return 0
    with make_daemon(device=options.device, timeout_s=FRAME_SECONDS[options.size]) as daemon:
        folder = options.keep or daemon.folder / "scenes"
        folder.mkdir(parents=True, exist_ok=True)
        groups = outcomes(daemon, options, folder)
        if options.json:
            results = [outcome for _, group in groups for outcome in group]
            _print_json(results)
        else:
            results = _print_table(groups, options)
    return 1 if any(outcome.status == "FAIL" for outcome in results) else 0
