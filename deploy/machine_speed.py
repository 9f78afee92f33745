"""How many times slower than usual this machine is today: what time budgets are multiplied by.

usage: machine_speed.py BUILD [EARLIER]

Runs a fixed amount of work that has nothing of the product in it (tests/tools/machine_speed.c), so that
code that becomes slower has no more time for it. At least 1, at most 3, and no less than EARLIER, what was
found before; 1 if it does not run, which the tests will tell better.
"""
import pathlib
import subprocess
import sys

# The machine that budgets were measured on, two idle cores of an AMD EPYC, is no longer at hand. It took
# 391 ms for 1,024 VPLs at 512x512, and on another one this work took as long as those did then: .997
# times, in eight turns, both 1.25 times slower than usual.
USUAL_MS = 390
SLOWEST = 3


def work_ms(build):
    program = pathlib.Path(build) / "tests/tools/machine_speed"
    ran = subprocess.run([program], check=True, timeout=120, capture_output=True)
    return float(ran.stdout)


def budget_factor(ms):
    return min(max(ms / USUAL_MS, 1), SLOWEST)


def main():
    try:
        ms = work_ms(sys.argv[1])
        factor = budget_factor(ms)
        print(f"work {ms:.0f} ms, usually {USUAL_MS}: budgets x {factor:.2f}", file=sys.stderr)
    except (OSError, subprocess.SubprocessError, ValueError) as error:
        factor = 1
        print(f"the machine's speed is not known: {error}", file=sys.stderr)
    earlier = float(sys.argv[2]) if len(sys.argv) > 2 else 1
    print(f"{max(factor, earlier):.2f}")


if __name__ == "__main__":
    main()
