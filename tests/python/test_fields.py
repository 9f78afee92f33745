"""What the client's type hints say of objects' fields and of frames is what the daemon's table says."""
import json
import os
import pathlib
import subprocess
import sys

from bounced import fields
from bounced.messages import pb

MAKER = pathlib.Path(__file__).resolve().parents[2] / "clients/python/make_fields.py"


def test_made_from_the_table():
    made = subprocess.run([sys.executable, str(MAKER), os.environ["BOUNCE"]], check=True, capture_output=True, text=True)
    assert made.stdout == pathlib.Path(fields.__file__).read_text(), \
        "run clients/python/make_fields.py bounce > clients/python/bounced/fields.py"


def test_every_field_of_the_schema_has_a_row():
    """In the schema, an edit of an object has its id and its rows."""
    told = subprocess.run([os.environ["BOUNCE"], "edit", "--help-ops", "--json"], check=True, capture_output=True, text=True)
    kinds = {one["kind"]: [field["name"] for field in one["fields"]] for one in json.loads(told.stdout)}
    for kind, rows in kinds.items():
        message = pb.Environment if kind == "environment" else getattr(pb, kind.capitalize() + "Edit")
        assert sorted(rows) == sorted(name for name in message.DESCRIPTOR.fields_by_name if name != kind), kind
    operations = [operation["name"] for one in json.loads(told.stdout) for operation in one["operations"]]
    assert sorted(operations) == sorted(pb.EditOp.DESCRIPTOR.fields_by_name)


def test_every_option_of_a_frame_has_a_row():
    told = subprocess.run([os.environ["BOUNCE"], "render", "--help", "--json"], check=True, capture_output=True, text=True)
    named = sorted(option["name"] for option in json.loads(told.stdout))
    assert named == sorted(pb.FrameRequest.DESCRIPTOR.fields_by_name) == sorted(fields.FrameOptions.__annotations__)


def test_told_to_people():
    told = subprocess.run([os.environ["BOUNCE"], "edit", "--help-ops"], check=True, capture_output=True, text=True).stdout
    assert all(f"  {name}" in told for name in pb.EditOp.DESCRIPTOR.fields_by_name)
    assert "a number from 1 to 1e+06, or 0, default 1.5" in told
