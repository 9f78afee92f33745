"""Figures of the source papers redrawn on the techniques of a build (papers/), beside the papers' own.

usage: redraw.py BUILD_DIR --scenes SCENES_DIR [-o DIR] [--help]
"""
import signal
import sys

import by_hand
from harness.daemon import NoDevice
from papers import command, options

EXIT_DEVICE, EXIT_INTERRUPTED = 6, 130


def main(words):
    asked = options.parse(words)
    by_hand.name_programs(asked.build, sys.exit)
    signal.signal(signal.SIGTERM, signal.default_int_handler)  # unwinds like Ctrl-C: the daemon is ended, too
    try:
        return command.main(asked, words)
    except NoDevice as fault:
        print(f"redraw: no device: {fault}", file=sys.stderr)
        return EXIT_DEVICE
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
