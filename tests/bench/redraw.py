"""Figures of the source papers redrawn on the techniques of a build (papers/), beside the papers' own.

usage: redraw.py BUILD_DIR --scenes SCENES_DIR [-o DIR] [--help]
"""
import sys

import by_hand
from harness.daemon import NoDevice
from papers import command, options

EXIT_DEVICE = 6


def main(words):
    asked = options.parse(words)
    by_hand.name_programs(asked.build, sys.exit)
    try:
        return command.main(asked, words)
    except NoDevice as fault:
        print(f"redraw: no device: {fault}", file=sys.stderr)
        return EXIT_DEVICE


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
