"""A run whose tools are missing reads as skipped."""
import pathlib
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[1]))
sys.dont_write_bytecode = True

from skips import pytest_sessionfinish  # noqa: E402,F401
