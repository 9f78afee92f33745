"""Compiles the processor's loops with gcc and clang for every width, and looks whether they are packed.

usage: packed.py SOURCE_ROOT WIDTHS FLAG...

WIDTHS are `name:flag,flag` joined by blanks. Every loop over lanes divides or takes a root, so one that the compiler
left as it is shows by a scalar instruction of those kinds, beyond what is worked out before the loop for all lanes; and
packed ones must be of that width.
"""
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile

SCALAR = re.compile(r"\bv?(div|sqrt)ss\b")
PACKED = re.compile(r"\bv?(div|sqrt)ps\b.*%([xyz])mm")
REGISTERS = {"baseline": "x", "avx2": "y", "avx512": "z"}
# Divisions and roots of loops, at least, and those for all lanes at once.
SOURCES = {"build_tree.c": (30, 0), "choose.c": (48, 2), "direct.c": (33, 4), "gather.c": (47, 0), "gather_glossy.c": (40, 0), "gather_tree.c": (58, 2), "imperfect_shadows.c": (4, 4), "project.c": (14, 1), "residual.c": (31, 6)}


def instructions(program):
    ran = subprocess.run(["objdump", "-d", "--no-show-raw-insn", program], check=True, capture_output=True, text=True)
    return ran.stdout.splitlines()


def faults_of(compiler, root, source, width, flags, folder):
    out = folder / "loops.o"
    subprocess.run([compiler, "-std=c17", f"-I{root}/server", f"-I{root}/shaders", *flags, f"-DBD_WIDTH={width}", "-c",
                    root / "server/pass/native" / source, "-o", out], check=True)
    lines = instructions(out)
    packed = [found[2] for found in map(PACKED.search, lines) if found]
    where = f"{compiler} {width} {source}"
    print(f"{where}: {len(packed)} packed divisions and roots, of {''.join(sorted(set(packed)))}mm")
    scalar = list(filter(SCALAR.search, lines))
    least, for_all = SOURCES[source]
    if len(scalar) > for_all:
        yield f"{where}: a loop is not packed: {len(scalar)} scalar ones, {for_all} expected, the last {scalar[-1].strip()}"
    if packed.count(REGISTERS[width]) < least:
        yield f"{where}: {packed.count(REGISTERS[width])} of the width's own registers, {least} expected"


def main():
    root, widths, flags = pathlib.Path(sys.argv[1]), sys.argv[2].split(), sys.argv[3:]
    compilers = [name for name in ("gcc", "clang") if shutil.which(name)]
    if len(compilers) < 2 or not shutil.which("objdump"):
        print("skipped: gcc, clang and objdump are not all here")
        return 77
    faults = []
    with tempfile.TemporaryDirectory() as folder:
        for compiler in compilers:
            for width, _, own in (word.partition(":") for word in widths):
                for source in SOURCES:
                    faults += faults_of(compiler, root, source, width, flags + own.split(",") * bool(own), pathlib.Path(folder))
    print("\n".join(faults))
    return bool(faults)


if __name__ == "__main__":
    sys.exit(main())
