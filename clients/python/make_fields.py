"""bounced/fields.py: what edits can say of objects, and what frames can be asked to be, by the daemon's own tables.

usage: make_fields.py BOUNCE > bounced/fields.py
"""
import json
import subprocess
import sys

TYPES = {"text": "str", "switch": "bool", "word": "str", "object": "Reference"}
OPTION_TYPES = {"text": "str", "switch": "bool", "whole": "int", "number": "float"}
IN_PYTHON = {"camera": "str | int", "exposure": "str | float", "pose": "Pose", "parameters": "dict[str, Any]"}


def type_of(field):
    if field["type"] == "numbers":
        return "float" if field["count"] == 1 else "Vector"
    return TYPES[field["type"]]


def lines_of(kind):
    fields = [one for one in kind["fields"] if one["type"] != "heavy"]
    yield f"class {kind['kind'].capitalize()}Fields(TypedDict, total=False):"
    for field in fields:
        yield f"    {field['name']}: {type_of(field)}  # {field['takes']}: {field['help']}"


def type_of_option(option):
    if option["name"] in IN_PYTHON:
        return IN_PYTHON[option["name"]]
    one = OPTION_TYPES[option["type"]]
    if option["count"]:
        return f"tuple[{', '.join([one] * option['count'])}]"
    return f"Sequence[{one}]" if option["many"] else one


def print_options(options):
    print("class FrameOptions(TypedDict, total=False):")
    print('    """What a frame can be asked to be. `encoding` is "exr" where it is not said, and then not compressed."""\n')
    for option in options:
        takes = f"{option['takes']}: " if option["name"] not in IN_PYTHON else ""
        default = f" (default {option['standard']})" if option["standard"] else ""
        print(f"    {option['name']}: {type_of_option(option)}  # {takes}{option['help']}{default}")
    print(f"\n\nOPTION_LENGTHS = { {option['name']: option['count'] for option in options if option['count']} !r}")


def told(*words):
    return json.loads(subprocess.run([sys.argv[1], *words, "--json"], check=True, capture_output=True, text=True).stdout)


def main():
    kinds = told("edit", "--help-ops")
    fields = [field for kind in kinds for field in kind["fields"]]
    references = sorted({field["name"] for field in fields if field["type"] == "object"} | {kind["kind"] for kind in kinds})
    lengths = {field["name"]: field["count"] for field in fields if field.get("count", 1) > 1}
    print('"""What edits and frames can say. Made by make_fields.py from the daemon\'s table: not to be changed by hand."""')
    print("from __future__ import annotations\n")
    print("from typing import TYPE_CHECKING, Any, Sequence, TypedDict\n")
    print("from .types import Vector\n")
    print("if TYPE_CHECKING:")
    print("    from .edit import Reference\n    from .frame import Pose\n")
    print(f"REFERENCES = frozenset({references!r})")
    print(f"LENGTHS = {lengths!r}  # of lists of numbers")
    for kind in kinds:
        if kind["kind"] in ("mesh", "environment"):
            continue  # whose operations are functions with arguments of their own
        print("\n")
        print("\n".join(lines_of(kind)))
    print("\n")
    print_options(told("render", "--help"))


if __name__ == "__main__":
    main()
