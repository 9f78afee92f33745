"""The schema's messages, and what they are in Python: dictionaries in the protocol's JSON form."""
from __future__ import annotations

from typing import Any

try:
    import bounced_pb2
except ImportError as error:
    if error.name != "bounced_pb2":
        raise ImportError(f"bounced needs Debian's python3-protobuf: {error}") from error
    raise ImportError(
        "bounced_pb2 is not beside the package: the build makes it (ninja -C build; it lies in "
        "build/clients/python), or protoc --python_out=DIR protocol/bounced.proto") from error

from .errors import Error, error_of

pb: Any = bounced_pb2

# Before a request's answer, or (of watches and views) behind it.
EVENTS = frozenset(("progress", "scene_event", "view_frame", "view_end"))


def _number_or_text(text: str) -> int | float | str:
    for kind in (int, float):
        try:
            return kind(text)
        except ValueError:
            continue
    return text


def _plain(field: Any, value: Any) -> Any:
    return as_dict(value) if field.message_type is not None else value


def _list_or_table(field: Any, values: Any) -> Any:
    if field.message_type is not None and field.message_type.name == "KeyValue":
        return {pair.key: _number_or_text(pair.value) for pair in values}
    return [_plain(field, value) for value in values]


def as_dict(message: Any) -> dict[str, Any]:
    """A message as a dictionary: fields that are not set are left out, empty lists are not, and a
    table of keys and values is a dictionary whose values are numbers where they read as such."""
    out: dict[str, Any] = {}
    for field in message.DESCRIPTOR.fields:
        value = getattr(message, field.name)
        if field.label == field.LABEL_REPEATED:
            out[field.name] = _list_or_table(field, value)
        elif message.HasField(field.name):
            out[field.name] = _plain(field, value)
    return out


def error_from(error: Any) -> Error:
    """The exception that an Error message stands for."""
    report = as_dict(error.details.report) if error.details.HasField("report") else None
    return error_of(error.code or "internal", error.message or "no reason given",
                    error.details.field, report)


def add_pairs(table: Any, pairs: dict[str, Any]) -> None:
    """Appends a dictionary to a repeated KeyValue."""
    for key, value in pairs.items():
        if isinstance(value, bool):
            value = int(value)
        table.add(key=key, value=str(value))
