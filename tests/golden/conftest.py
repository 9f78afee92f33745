"""A run whose pictures or device are missing reads as skipped."""
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[1]))

from skips import pytest_sessionfinish  # noqa: E402,F401
