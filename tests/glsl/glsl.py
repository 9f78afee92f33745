"""Compiles every program of programs.txt with glslangValidator, and holds the table to the tree.

usage: glsl.py ASSEMBLE PROGRAMS.txt SHADER_FOLDER

Drivers differ in strictness, and one machine has one of them; the reference compiler is strict and
needs no device. A shader file that no program uses fails the test, so the table stays whole.
"""

import concurrent.futures
import itertools
import math
import os
import shutil
import subprocess
import sys
import tempfile

SUFFIXES = ('.comp', '.vert', '.frag', '.glsl', '.h')
COMBINATIONS_MAX = 16
VALIDATOR = 'glslangValidator'
BATCH = 32  # programs of one stage to a run of it


def choices_of(word):
    """'NAME?' is defined or not, 'NAME=0|1' has one of the values."""
    if word.endswith('?'):
        return [None, word[:-1] + '=1']
    name, values = word.split('=')
    return [f'{name}={value}' for value in values.split('|')]


def variants_of(choices):
    """Every combination while they are few; else the first of each, the last of each, and those two
    with one place changed."""
    if math.prod(map(len, choices)) <= COMBINATIONS_MAX:
        return list(itertools.product(*choices))
    variants = []
    for base in ([c[0] for c in choices], [c[-1] for c in choices]):
        variants.append(tuple(base))
        for i, options in enumerate(choices):
            variants.extend(tuple(base[:i] + [o] + base[i + 1:]) for o in options)
    return list(dict.fromkeys(variants))


def parse_row(line):
    """(files, [defines of one variant, ...])"""
    words = line.split()
    files = [word for word in words if word.endswith(('.comp', '.vert', '.frag'))]
    variants = variants_of([choices_of(word) for word in words[len(files):]])
    return files, [[define for define in variant if define] for variant in variants]


def read_table(path):
    with open(path, encoding='utf-8') as file:
        lines = (line.split('#')[0].strip() for line in file)
        return [parse_row(line) for line in lines if line]


def run_validator(options, texts):
    """Of [(file name, text)]. Its complaints, empty if none."""
    with tempfile.TemporaryDirectory() as folder:
        paths = []
        for i, (name, text) in enumerate(texts):
            paths.append(os.path.join(folder, f'{i}.{os.path.basename(name)}'))
            with open(paths[-1], 'w', encoding='utf-8') as file:
                file.write(text)
        run = subprocess.run([VALIDATOR, *options, *paths], capture_output=True, text=True,
                             check=False)
    return run.stdout + run.stderr if run.returncode else ''


def validate(program):
    """Compiles [(file name, text)] as one program, its stages linked to each other."""
    return run_validator(['-l'], program)


def validate_many(programs):
    """[complaint of each]. Programs of one stage need no linking: one run of the validator, most of whose time
    is its own start, does for all of them, and they are told apart only if one is wrong."""
    one_stage = all(len(program) == 1 for program in programs)
    if one_stage and not run_validator([], [program[0] for program in programs]):
        return [''] * len(programs)
    return [validate(program) for program in programs]


def batches(programs):
    """[names of programs that go through the validator together]"""
    alone = [[name] for name, program in programs.items() if len(program) > 1]
    together = [name for name, program in programs.items() if len(program) == 1]
    return alone + [together[i:i + BATCH] for i in range(0, len(together), BATCH)]


def assembled(assemble, device, files, defines, used):
    """[(file, text that a driver would get)]; notes the files that it was made of."""
    texts = []
    for name in files:
        run = subprocess.run([assemble, device, name, *defines], capture_output=True, text=True,
                             check=False)
        if run.returncode:
            sys.exit(f'{" ".join(files)}: {run.stderr}')
        used.update(run.stderr.split())
        texts.append((name, run.stdout))
    return texts


def shader_files(folder):
    for path, _, names in os.walk(folder):
        for name in names:
            if name.endswith(SUFFIXES):
                yield os.path.relpath(os.path.join(path, name), folder)


def main():
    assemble, table, folder = sys.argv[1:]
    if not shutil.which(VALIDATOR):
        print(f'skipped: no {VALIDATOR} on this machine')
        return 77
    # The validator itself: a program that it must refuse, alone and among others.
    good = [('good.comp', '#version 450 core\nvoid main() {}\n')]
    bad = [('bad.comp', '#version 450 core\nvoid main() { x = 1; }\n')]
    if [bool(complaint) for complaint in validate_many([good, bad, good])] != [False, True, False]:
        print(f'{VALIDATOR} accepts a program that is wrong')
        return 1
    programs, used = {}, set()
    for files, variants in read_table(table):
        for defines, device in itertools.product(variants, ('software', 'hardware')):
            name = f'{" ".join(files)} {" ".join(defines)} ({device})'
            programs[name] = assembled(assemble, device, files, defines, used)
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        groups = batches(programs)
        answers = pool.map(validate_many, ([programs[name] for name in group] for group in groups))
    failed = 0
    for group, complaints in zip(groups, answers):
        for name, complaint in zip(group, complaints):
            if complaint:
                failed += 1
                print(f'{name}:\n{complaint}')
    for name in sorted(set(shader_files(folder)) - used):
        failed += 1
        print(f'shaders/{name}: no program of {os.path.basename(table)} uses it')
    print(f'{len(programs)} programs compiled, {failed} faults')
    return 1 if failed or not programs else 0


sys.exit(main())
