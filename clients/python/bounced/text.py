"""Words of others, fit for a line that people read."""
from __future__ import annotations

import unicodedata

# Default_Ignorable, beside the categories below: not seen either.
_UNSEEN = set("\u034f\u115f\u1160\u17b4\u17b5\u3164\uffa0")


def plain(text: str) -> str:
    """`text` with a question mark for what commands a terminal, or is not seen and yet changes the line.

    Names and messages come from whoever wrote a file or an edit. Control characters could command the
    terminal; U+202E turns a name around, a zero-width space makes two look the same.
    """
    return "".join("?" if unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp") or c in _UNSEEN
                   or "\U000e0000" <= c <= "\U000e0fff" or "\u180b" <= c <= "\u180f" else c for c in text)
