"""explanations.txt: one sentence for each ratio that misses its target and for each cost curve.

A line is "FIGURE ID: sentence"; written by a person from what was measured, and shown beside the
figure. The program adds none of its own.
"""
from pathlib import Path

FILE = Path(__file__).with_name("explanations.txt")


def parsed(text):
    """{(figure, id): sentence}"""
    found = {}
    for number, line in enumerate(text.splitlines(), 1):
        if not line.strip() or line.startswith("#"):
            continue
        head, colon, sentence = line.partition(": ")
        words = head.split()
        if not (colon and len(words) == 2 and sentence.strip()):
            raise ValueError(f"explanations.txt:{number}: must be FIGURE ID: sentence")
        if tuple(words) in found:
            raise ValueError(f"explanations.txt:{number}: {head} is explained twice")
        found[tuple(words)] = sentence.strip()
    return found


def load():
    return parsed(FILE.read_text(encoding="utf-8"))
