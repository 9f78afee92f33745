"""protocol/manual.md is what make_manual.py makes of the schema, the tables and the help texts.

usage: test_manual.py SOURCE_ROOT BOUNCE BOUNCED
"""
import difflib
import pathlib
import subprocess
import sys


def main():
    root, *programs = sys.argv[1:]
    manual = pathlib.Path(root, "protocol/manual.md")
    command = [sys.executable, str(manual.parent / "make_manual.py"), root, *programs]
    made = subprocess.run(command, check=True, stdout=subprocess.PIPE, encoding="utf-8").stdout
    kept = manual.read_text(encoding="utf-8")
    if made == kept:
        return
    sys.stdout.writelines(difflib.unified_diff(kept.splitlines(True), made.splitlines(True), "manual.md", "what is made", n=1))
    sys.exit("run: python3 protocol/make_manual.py . BUILD/clients/cli/bounce BUILD/server/bounced > protocol/manual.md")


if __name__ == "__main__":
    main()
