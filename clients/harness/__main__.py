"""python3 -m harness COMMAND [OPTIONS]

    stability    techniques x hazards; with --relations or --oracles first, those:
    relations    techniques x metamorphic relations x scenes
    oracles      techniques x closed forms
    bench        error against run time

Each has --help. $BOUNCE and $BOUNCED name the executables.
"""
import importlib
import signal
import sys

from .daemon import NoDevice

COMMANDS = ("stability", "relations", "oracles", "bench")
EXIT_USAGE, EXIT_DEVICE, EXIT_INTERRUPTED = 2, 6, 130


def _ended(*_):
    """SIGTERM unwinds like Ctrl-C, so that the private daemon is ended too."""
    raise KeyboardInterrupt


def main(words):
    if words[:1] == ["stability"] and words[1:2] in (["--relations"], ["--oracles"]):
        words = [words[1][2:], *words[2:]]
    if not words or words[0] not in COMMANDS:
        wants_help = words[:1] in (["-h"], ["--help"])
        print(__doc__, file=sys.stdout if wants_help else sys.stderr, end="")
        return 0 if wants_help else EXIT_USAGE
    signal.signal(signal.SIGTERM, _ended)
    try:
        return importlib.import_module(f".{words[0]}", __package__).main(words[1:])
    except NoDevice as fault:
        print(f"{words[0]}: no device: {fault}", file=sys.stderr)
        return EXIT_DEVICE
    except KeyboardInterrupt:
        return EXIT_INTERRUPTED


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
