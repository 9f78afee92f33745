"""bench: error against run time. README.md above says how it is used; each module's docstring says what it is."""
from .command import main

__all__ = ["main"]
