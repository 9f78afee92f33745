"""Compiles each header alone: it must include what it needs.

usage: headers.py SOURCE_ROOT BUILD_ROOT C_COMPILER CPP_COMPILER

As C17, and as C++17 too if it offers itself to C++ by an extern "C" block.
"""

import concurrent.futures
import glob
import json
import os
import shlex
import subprocess
import sys

PATTERNS = ('server/*/*.h', 'shaders/shared/*.h', 'protocol/*.h')
WARNINGS = ['-Wall', '-Wextra', '-Wpedantic', '-Werror', '-D_GNU_SOURCE', '-fsyntax-only']


def include_flags(build_root):
    """Every folder that the build looks for headers in."""
    flags = []
    with open(os.path.join(build_root, 'compile_commands.json'), encoding='utf-8') as file:
        commands = json.load(file)
    for command in commands:
        words = shlex.split(command['command'])
        for word, following in zip(words, words[1:] + ['']):
            flag = f'-isystem{following}' if word == '-isystem' else word
            if flag.startswith(('-I', '-isystem')) and flag != '-isystem' and flag not in flags:
                flags.append(flag)
    return flags


def compiles(compiler, language, standard, flags, path, build_root):
    command = [*shlex.split(compiler), *WARNINGS, f'-std={standard}', *flags, '-x', language, '-']
    # The declaration keeps a header of macros from being an empty unit, which C forbids.
    text = f'#include "{path}"\ntypedef int header_was_read;\n'
    run = subprocess.run(command, cwd=build_root, input=text, capture_output=True, text=True,
                         check=False)
    if run.returncode:
        print(f'{path} as {standard}:\n{run.stderr}')
    return run.returncode == 0


def main():
    source_root, build_root, c_compiler, cpp_compiler = sys.argv[1:]
    flags = include_flags(build_root)
    paths = sorted(sum((glob.glob(os.path.join(source_root, p)) for p in PATTERNS), []))

    def stands_alone(path):
        with open(path, encoding='utf-8') as file:
            for_cpp = 'extern "C"' in file.read()
        return compiles(c_compiler, 'c', 'c17', flags, path, build_root) and (
            not for_cpp or compiles(cpp_compiler, 'c++', 'c++17', flags, path, build_root))

    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        failed = list(pool.map(stands_alone, paths)).count(False)
    print(f'{len(paths)} headers, {failed} do not stand alone')
    return 1 if failed or len(paths) < 10 else 0


sys.exit(main())
