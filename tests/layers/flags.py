"""Holds what the rooms flag in a frame's report to the table of flags (server/base/flags.h), both ways.

usage: flags.py SOURCE_ROOT

A name that the table lacks could not be named on a command line; a row that nobody writes is a
promise that nobody keeps.
"""

import pathlib
import re
import sys

ROW = re.compile(r'^\s*X\(([a-z_]+), (?:true|false),', re.M)
NAME = re.compile(r'"([a-z]+(?:_[a-z]+)+)(?=[":%])')
# What writes flags: calls up to their first text, and the table of repairs behind one of them.
CALL = re.compile(r'\bbd_(?:report|scene)_flag\(\s*[^;"]*?("(?:[^"\\]|\\.)*")', re.S)
REPAIR = re.compile(r'\{("[a-z_]+"), repairs->')
MACRO = re.compile(r'^#define BD_FLAG_\w+ ("[a-z_]+")', re.M)


def written(text):
    for pattern in (CALL, REPAIR, MACRO):
        for found in pattern.findall(text):
            yield from NAME.findall(found)


def main():
    server = pathlib.Path(sys.argv[1]) / 'server'
    rows = set(ROW.findall((server / 'base/flags.h').read_text(encoding='utf-8')))
    names = {}
    for path in sorted(server.rglob('*.[ch]')):
        for name in written(path.read_text(encoding='utf-8')):
            names.setdefault(name, path.relative_to(server.parent))
    faults = [f'{path}: flag {name} has no row in server/base/flags.h'
              for name, path in names.items() if name not in rows]
    faults += [f'server/base/flags.h: nobody flags {name}' for name in sorted(rows - set(names))]
    print('\n'.join(faults) if faults else f'{len(rows)} flags are as the table has them')
    return 1 if faults or len(rows) < 10 else 0


sys.exit(main())
