"""bench: error against run time. See command.py for what it does, README.md above for the modules."""
from .command import main

__all__ = ["main"]
