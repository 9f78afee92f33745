"""What callers pass, held to what is due: TypeError for another kind of thing, ValueError for a value
out of range, each with the parameter's name, what is due, and what came."""
from __future__ import annotations

import os
from collections.abc import Sequence as AnySequence
from numbers import Integral, Real
from typing import Any, Callable, NoReturn

import numpy

_SHOWN_CHARACTERS = 60


def wrong_kind(name: str, due: str, value: Any) -> NoReturn:
    shown = repr(value)
    if len(shown) > _SHOWN_CHARACTERS:
        shown = shown[:_SHOWN_CHARACTERS] + "..."
    raise TypeError(f"{name}: {due} is due, not {shown} ({type(value).__name__})")


def whole(name: str, value: Any, least: int = 0, most: int = (1 << 64) - 1) -> int:
    if not isinstance(value, Integral) or isinstance(value, bool):
        wrong_kind(name, "a whole number", value)
    if not least <= value <= most:
        raise ValueError(f"{name}: a whole number from {least} to {most} is due, not {value}")
    return int(value)


def number(name: str, value: Any) -> float:
    if not isinstance(value, Real) or isinstance(value, (bool, numpy.bool_)):
        wrong_kind(name, "a number", value)
    return float(value)


def text(name: str, value: Any) -> str:
    if not isinstance(value, str):
        wrong_kind(name, "a text", value)
    return value


def truth(name: str, value: Any) -> bool:
    if not isinstance(value, (bool, numpy.bool_)):
        wrong_kind(name, "True or False", value)
    return bool(value)


def path(name: str, value: Any) -> str:
    if not isinstance(value, (str, os.PathLike)):
        wrong_kind(name, "a path", value)
    return os.fspath(value)


def table(name: str, value: Any) -> dict[str, Any]:
    if not isinstance(value, dict):
        wrong_kind(name, 'a dictionary such as {"vpls": 1024}', value)
    for key in value:
        text(f"a key of {name}", key)
    return value


def row(name: str, values: Any, item: Callable[[str, Any], Any] = number,
        length: int | None = None, due: str = "") -> list[Any]:
    """A sequence, or an array of one dimension; a text is none, though Python thinks so."""
    due = due or f"a sequence of {'numbers' if length is None else f'{length} numbers'}"
    is_row = isinstance(values, numpy.ndarray) and values.ndim == 1 or (
        isinstance(values, AnySequence) and not isinstance(values, (str, bytes, bytearray)))
    if not is_row:
        wrong_kind(name, due, values)
    if length is not None and len(values) != length:
        raise ValueError(f"{name}: {due} is due, not {len(values)}")
    return [item(f"{name}[{i}]", value) for i, value in enumerate(values)]


def scalar(descriptor: Any, name: str, value: Any) -> Any:
    """As a field of a message takes it."""
    kind = descriptor.cpp_type
    if kind == descriptor.CPPTYPE_BOOL:
        return truth(name, value)
    if kind in (descriptor.CPPTYPE_DOUBLE, descriptor.CPPTYPE_FLOAT):
        return number(name, value)
    if kind == descriptor.CPPTYPE_STRING:
        return text(name, value)
    bits = 32 if kind in (descriptor.CPPTYPE_INT32, descriptor.CPPTYPE_UINT32) else 64
    signed = kind in (descriptor.CPPTYPE_INT32, descriptor.CPPTYPE_INT64)
    least, most = (-1 << bits - 1, (1 << bits - 1) - 1) if signed else (0, (1 << bits) - 1)
    return whole(name, value, least, most)


def put(message: Any, name: str, value: Any, length: int | None = None) -> None:
    """Sets a field of plain values, or appends to one that has many."""
    descriptor = message.DESCRIPTOR.fields_by_name[name]
    if descriptor.label != descriptor.LABEL_REPEATED:
        setattr(message, name, scalar(descriptor, name, value))
        return
    is_text = descriptor.cpp_type == descriptor.CPPTYPE_STRING
    getattr(message, name).extend(
        row(name, value, lambda place, item: scalar(descriptor, place, item), length,
            "a sequence of names" if is_text else ""))
