"""python3 -m harness COMMAND [OPTIONS]

    stability    techniques x hazards; with --relations or --oracles first, those:
    relations    techniques x metamorphic relations x scenes
    oracles      techniques x closed forms
    bench        error against run time

Each has --help. $BOUNCE and $BOUNCED name the executables.
"""
import importlib
import os
import signal
import sys

EXIT_FAILED, EXIT_USAGE, EXIT_UNSUPPORTED, EXIT_DEVICE, EXIT_INTERRUPTED = 1, 2, 4, 6, 130

try:
    from .daemon import NoDevice
except ModuleNotFoundError as missing:
    if missing.name != "numpy":
        raise
    print("bounce: this command needs numpy (Debian: python3-numpy)", file=sys.stderr)
    sys.exit(EXIT_UNSUPPORTED)

COMMANDS = ("stability", "relations", "oracles", "bench")


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
    except SystemExit as end:
        if not isinstance(end.code, str):
            raise
        print(f"bounce {words[0]}: {end.code}", file=sys.stderr)  # a text: what was asked for wrongly
        return EXIT_USAGE
    except BrokenPipeError:  # whoever read our output has enough; nothing is left to flush to
        os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
        return EXIT_FAILED


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
