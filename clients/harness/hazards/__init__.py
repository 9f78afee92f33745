"""The rows of the hazard table (algorithms.md, chapter C), as generated scenes with known answers.

A row is a function in one of the modules here; importing this package registers them all.
"""
from . import beams, inputs, pictures, ranges, senders, stages, surfaces, units  # noqa: F401
from .row import ROWS  # noqa: F401
