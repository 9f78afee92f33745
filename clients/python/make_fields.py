"""bounced/fields.py: what edits can say of objects, by the daemon's own table.

usage: make_fields.py BOUNCE > bounced/fields.py
"""
import json
import subprocess
import sys

TYPES = {"text": "str", "switch": "bool", "word": "str", "object": "Reference"}


def type_of(field):
    if field["type"] == "numbers":
        return "float" if field["count"] == 1 else "Vector"
    return TYPES[field["type"]]


def lines_of(kind):
    fields = [one for one in kind["fields"] if one["type"] != "heavy"]
    yield f"class {kind['kind'].capitalize()}Fields(TypedDict, total=False):"
    for field in fields:
        yield f"    {field['name']}: {type_of(field)}  # {field['takes']}: {field['help']}"


def main():
    told = subprocess.run([sys.argv[1], "edit", "--help-ops", "--json"], check=True, capture_output=True, text=True)
    kinds = json.loads(told.stdout)
    fields = [field for kind in kinds for field in kind["fields"]]
    references = sorted({field["name"] for field in fields if field["type"] == "object"} | {kind["kind"] for kind in kinds})
    lengths = {field["name"]: field["count"] for field in fields if field.get("count", 1) > 1}
    print('"""What edits can say of objects. Made by make_fields.py from the daemon\'s table: not to be changed by hand."""')
    print("from __future__ import annotations\n")
    print("from typing import TYPE_CHECKING, TypedDict\n")
    print("from .types import Vector\n")
    print("if TYPE_CHECKING:")
    print("    from .edit import Reference\n")
    print(f"REFERENCES = frozenset({references!r})")
    print(f"LENGTHS = {lengths!r}  # of lists of numbers")
    for kind in kinds:
        if kind["kind"] in ("mesh", "environment"):
            continue  # whose operations are functions with arguments of their own
        print("\n")
        print("\n".join(lines_of(kind)))


if __name__ == "__main__":
    main()
