"""Which suites deploy/check runs in a build, and what came of them.

usage: results.py suites BUILD BUDGETS COLUMN          the suites to run, one a line
       results.py count TESTLOG_JSON BUDGETS COLUMN FACTOR
       results.py slowest TESTLOG_JSON...              the slowest ten tests of all
       results.py failed TESTLOG_JSON...               how each test that failed ended, in its own last lines

BUDGETS (deploy/budgets) has a row for each suite; COLUMN is 1 for the first build, 2 for the second; a row with `-`
there is not run. `suites` fails if the build has a suite that no row names. `count` prints a table of suites on
standard error and `PASSED FAILED SKIPPED` on standard output; a suite beyond its budget, which is multiplied by
FACTOR (machine_speed.py), counts as one failure.
"""

import collections
import json
import math
import subprocess
import sys

PASSED = ('OK', 'EXPECTEDFAIL')
NOT_RUN = '-'
LAST_LINES = 60  # of a test that failed: where each thread of a test that hung was takes about forty
LONG = 'long'  # no part of the table, and without a budget: deploy/check --long


def read_rows(path, column):
    """{suite: its word in that column}"""
    with open(path, encoding='utf-8') as file:
        rows = (line.split('#')[0].split() for line in file)
        return {words[0]: words[column] for words in rows if words}


def read_log(path):
    with open(path, encoding='utf-8') as log:
        yield from map(json.loads, filter(str.strip, log))


def read_tests(path):
    """(suite, name, result, seconds) of each test of a log."""
    for test in read_log(path):
        # "project:suite / name"
        suite, _, name = test['name'].partition(' / ')
        yield suite.split(':')[-1], name, test['result'], test['duration']


def suites(build, budgets, column):
    rows = read_rows(budgets, int(column))
    ran = subprocess.run(['meson', 'introspect', '--tests', build], check=True, capture_output=True)
    there = {suite.split(':')[-1] for test in json.loads(ran.stdout) for suite in test['suite']}
    unknown = sorted(there - set(rows) - {LONG})
    if unknown:
        print(f'{budgets} has no row for {", ".join(unknown)}', file=sys.stderr)
        return 1
    print(*sorted(suite for suite in there & set(rows) if rows[suite] != NOT_RUN), sep='\n')
    return 0


def over_budget(seconds, rows, factor):
    """How many suites are; prints the table."""
    over = 0
    for suite, spent in sorted(seconds.items()):
        allowed = math.inf if suite == LONG else factor * float(rows[suite])
        over += spent > allowed
        print(f'{suite:12}{spent:8.1f} s of {allowed:5.0f} s{"  OVER" if spent > allowed else ""}',
              file=sys.stderr)
    return over


def count(log, budgets, column, factor):
    results, seconds = collections.Counter(), collections.Counter()
    for suite, _, result, spent in read_tests(log):
        results[result] += 1
        seconds[suite] += spent
    over = over_budget(seconds, read_rows(budgets, int(column)), float(factor))
    skipped = results.pop('SKIP', 0)
    passed = sum(results.pop(name, 0) for name in PASSED)
    print(passed, sum(results.values()) + over, skipped)
    return 0


def slowest(*logs):
    tests = [(spent, f'{suite} / {name}', log.split('/')[0])
             for log in logs for suite, name, _, spent in read_tests(log)]
    print('the slowest ten:')
    for spent, name, build in sorted(tests, reverse=True)[:10]:
        print(f'{spent:8.1f} s  {name} ({build})')
    return 0


def failed(*logs):
    for log in logs:
        for test in read_log(log):
            if test['result'] in PASSED + ('SKIP',):
                continue
            said = test.get('stdout', '') + test.get('stderr', '')
            print(f'-- {test["name"]} ({log.split("/")[0]}): {test["result"]}', *said.splitlines()[-LAST_LINES:], sep='\n')
    return 0


COMMANDS = {'suites': suites, 'count': count, 'slowest': slowest, 'failed': failed}
sys.exit(COMMANDS[sys.argv[1]](*sys.argv[2:]))
