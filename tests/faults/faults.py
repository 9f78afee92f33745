"""Tests of the tests: breaks the code on purpose, one fault at a time, and wants each to be caught.

usage: faults.py SOURCE_ROOT FAULTS [--only NAME]... [--keep DIR] [--apply]

Works on a copy of the tracked files. A fault of the list is a replacement in one file and the tests
that must fail because of it; a fault that does not apply any more, does not build, or passes all of
its tests is a failure of this script. Before anything is broken the same tests must pass. --apply: only that each applies.

The list is read in blocks, separated by blank lines:

    fault NAME: what is wrong with it
    file PATH
    tests NAME [NAME...]        as `meson test` knows them
    - text to be replaced, exactly once in the file
    + text that stands there instead
"""

import argparse
import json
import pathlib
import shutil
import subprocess
import sys
import tempfile


def read_faults(path):
    faults = []
    for block in pathlib.Path(path).read_text(encoding='utf-8').split('\n\n'):
        fault = {'name': '', 'why': '', 'file': '', 'tests': [], 'old': [], 'new': []}
        for line in block.splitlines():
            word, _, rest = line.partition(' ')
            if word == 'fault':
                fault['name'], _, fault['why'] = (part.strip() for part in rest.partition(':'))
            elif word == 'file':
                fault['file'] = rest.strip()
            elif word == 'tests':
                fault['tests'] = rest.split()
            elif word in '-+' and word:
                fault['old' if word == '-' else 'new'].append(rest)
            elif word and not word.startswith('#'):
                sys.exit(f'{path}: what is "{line}"?')
        if fault['name']:
            faults.append(fault)
    return faults


def copy_tree(source, target):
    names = subprocess.run(['git', '-C', source, 'ls-files', '-z'], check=True,
                           capture_output=True, text=True).stdout.split('\0')
    for name in filter(None, names):
        if not (source / name).is_file():
            continue
        (target / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(source / name, target / name)
    shared = target.parent / 'shared'  # a tree that was kept has it
    if (source.parent / 'shared').is_dir() and not shared.exists():
        shared.symlink_to((source.parent / 'shared').resolve())


def run(words):
    return subprocess.run(words, capture_output=True, text=True, check=False)


def introspect(tree, what):
    return json.loads(run(['meson', 'introspect', tree / 'build', what]).stdout)


def needed_by(tree, tests):
    """The files that ninja has to make for these tests."""
    build_folder = str((tree / 'build').resolve())
    files = {target['id']: target['filename'] for target in introspect(tree, '--targets')}
    wanted = {target for test in introspect(tree, '--tests') if test['name'] in tests
              for target in test['depends']}
    return sorted(str(pathlib.Path(file).resolve().relative_to(build_folder))
                  for target in wanted for file in files[target])


def build(tree, tests):
    made = run(['ninja', '-C', tree / 'build', *needed_by(tree, tests)])
    return made.returncode == 0, made.stdout[-2000:]


def failing(tree, tests):
    """Names of those that do not pass."""
    return [test for test in tests
            if run(['meson', 'test', '-C', tree / 'build', '--no-rebuild', test]).returncode]


def why_not_applied(tree, fault):
    """None if its text stands once where it says."""
    path = tree / fault['file']
    count = path.read_text(encoding='utf-8').count('\n'.join(fault['old'])) if path.is_file() else 0
    return None if count == 1 else f'{fault["name"]}: its text stands {count} times in {fault["file"]}, not once'


def try_fault(tree, fault):
    """None if the fault is caught, else why not."""
    why = why_not_applied(tree, fault)
    if why:
        return why
    path = tree / fault['file']
    text = path.read_text(encoding='utf-8')
    old, new = '\n'.join(fault['old']), '\n'.join(fault['new'])
    path.write_text(text.replace(old, new), encoding='utf-8')
    try:
        built, output = build(tree, fault['tests'])
        if not built:
            return f'the broken code does not build:\n{output}'
        caught = failing(tree, fault['tests'])
        if not caught:
            return f'nothing noticed it: {" ".join(fault["tests"])}'
        print(f'caught   {fault["name"]}: {fault["why"]} (by {" ".join(caught)})', flush=True)
        return None
    finally:
        path.write_text(text, encoding='utf-8')


def check(tree, faults):
    tests = sorted({test for fault in faults for test in fault['tests']})
    if run(['meson', 'setup', tree / 'build', tree]).returncode or not build(tree, tests)[0]:
        return 'the tree does not build'
    broken = failing(tree, tests)
    if broken:
        return f'failing before anything was broken: {" ".join(broken)}'
    missed = 0
    for fault in faults:
        why = try_fault(tree, fault)
        if why:
            missed += 1
            print(f'MISSED   {fault["name"]}: {fault["why"]}\n         {why}', flush=True)
    print(f'{len(faults) - missed} of {len(faults)} faults caught')
    return f'{missed} faults were not caught' if missed else None


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument('source', type=pathlib.Path)
    parser.add_argument('faults')
    parser.add_argument('--only', action='append')
    parser.add_argument('--keep', type=pathlib.Path)
    parser.add_argument('--apply', action='store_true')
    options = parser.parse_args()
    faults = [fault for fault in read_faults(options.faults)
              if not options.only or fault['name'] in options.only]
    if options.apply:
        sys.exit('\n'.join(filter(None, (why_not_applied(options.source, fault) for fault in faults))) or None)
    with tempfile.TemporaryDirectory() as folder:
        tree = (options.keep or pathlib.Path(folder)) / 'main'
        tree.mkdir(parents=True, exist_ok=True)
        copy_tree(options.source.resolve(), tree)
        why = check(tree, faults)
    if why:
        sys.exit(f'faults: {why}')


main()
