"""What the client's type hints say of objects' fields is what the daemon's table says."""
import os
import pathlib
import subprocess
import sys

from bounced import fields

MAKER = pathlib.Path(__file__).resolve().parents[2] / "clients/python/make_fields.py"


def test_made_from_the_table():
    made = subprocess.run([sys.executable, str(MAKER), os.environ["BOUNCE"]], check=True, capture_output=True, text=True)
    assert made.stdout == pathlib.Path(fields.__file__).read_text(), \
        "run clients/python/make_fields.py bounce > clients/python/bounced/fields.py"
