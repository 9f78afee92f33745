"""Counts the results of one `meson test` run and holds its suites to their time budgets.

usage: count_results.py TESTLOG_JSON BUDGETS COLUMN FACTOR

Prints a table of suites on standard error and `PASSED FAILED SKIPPED` on standard output. A suite
beyond its budget, or without one, counts as one failure. COLUMN: 1 for the first build, 2 for the
second. FACTOR: what budgets are multiplied by (machine_speed.py).
"""

import collections
import json
import sys

PASSED = ('OK', 'EXPECTEDFAIL')


def read_budgets(path, column, factor):
    budgets = {}
    with open(path, encoding='utf-8') as file:
        for line in file:
            words = line.split('#')[0].split()
            if words:
                budgets[words[0]] = factor * float(words[column])
    return budgets


def read_results(path):
    """Counts by result, and seconds by suite."""
    results, seconds = collections.Counter(), collections.Counter()
    with open(path, encoding='utf-8') as log:
        for line in log:
            if not line.strip():
                continue
            test = json.loads(line)
            results[test['result']] += 1
            # "project:suite / name"
            suite = test['name'].split(' / ')[0].split(':')[-1]
            seconds[suite] += test['duration']
    return results, seconds


def over_budget(seconds, budgets):
    """How many suites are; prints the table."""
    over = 0
    for suite, spent in sorted(seconds.items()):
        allowed = budgets.get(suite, 0.0)
        over += spent > allowed
        remark = '' if spent <= allowed else '  OVER' if suite in budgets else '  NO BUDGET'
        print(f'{suite:12}{spent:8.1f} s of {allowed:5.0f} s{remark}', file=sys.stderr)
    return over


def main():
    results, seconds = read_results(sys.argv[1])
    over = over_budget(seconds, read_budgets(sys.argv[2], int(sys.argv[3]), float(sys.argv[4])))
    skipped = results.pop('SKIP', 0)
    passed = sum(results.pop(name, 0) for name in PASSED)
    print(passed, sum(results.values()) + over, skipped)


main()
