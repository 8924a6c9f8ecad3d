"""The text of a ROS 2 message definition, with those it refers to, taken apart into types and their fields.

References
----------
ROS 2 interface definition, https://docs.ros.org/en/rolling/Concepts/Basic/About-Interfaces.html; MCAP registry,
https://mcap.dev/spec/registry, "ros2msg": definitions behind each other, each but the first behind a line of equal
signs and one that reads ``MSG: package/Name``.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

from kempf.pipeline.ingest.messages.columns import NoReaderError

#: Name of a primitive type -> numpy's name of it.
PRIMITIVES = {
    "bool": "u1",
    "byte": "u1",
    "char": "u1",
    "int8": "i1",
    "uint8": "u1",
    "int16": "i2",
    "uint16": "u2",
    "int32": "i4",
    "uint32": "u4",
    "int64": "i8",
    "uint64": "u8",
    "float32": "f4",
    "float64": "f8",
}
_STAMP = "int32 sec\nuint32 nanosec"
#: Types that writers leave out of the definitions.
_KNOWN = {"builtin_interfaces/Time": _STAMP, "builtin_interfaces/Duration": _STAMP}
_SEPARATOR = re.compile(r"^={40,}[ \t]*$", re.MULTILINE)
_FIELD = re.compile(
    r"^(?P<type>[A-Za-z][\w/]*)(?:<=\d+)?(?P<array>\[(?:<=)?\d*\])?\s+(?P<name>[A-Za-z]\w*)\s*(?P<rest>.*)$"
)

#: Longest text of definitions that is read, characters.
_LONGEST = 1 << 20


@dataclass(frozen=True)
class Field:
    """One field of a message."""

    name: str
    #: A key of `PRIMITIVES`, ``string``, ``wstring``, or the full name of a message.
    kind: str
    #: None for one value, -1 for a sequence, else the length of an array.
    count: int | None


#: Full name ``package/Name`` -> fields in the order of the definition.
Types = dict[str, tuple[Field, ...]]


def types_of(name: str, definition: str) -> Types:
    """Take the text of a schema apart.

    Parameters
    ----------
    name : str
        Of the schema, ``package/msg/Name`` or ``package/Name``.

    Returns
    -------
    dict of str to tuple of Field
        By ``package/Name``, the schema's own among them.

    Raises
    ------
    NoReaderError
        A line is no field, or a type is not defined.
    """
    if len(definition) > _LONGEST:
        raise NoReaderError(f"its definition has more than {_LONGEST} characters")
    texts = dict(_KNOWN)
    first, *others = _SEPARATOR.split(definition)
    texts[full_name(name, "")] = first
    for part in others:
        head, _, body = part.lstrip().partition("\n")
        if head.startswith(("MSG:", "IDL:")):
            texts[full_name(head[4:].strip(), "")] = body
    types = {own: _fields(text, own.split("/")[0]) for own, text in texts.items()}
    for own, fields in types.items():
        for field in fields:
            if field.kind not in PRIMITIVES and field.kind not in ("string", "wstring") and field.kind not in types:
                raise NoReaderError(f"its field {own}.{field.name} is a {field.kind}, which is not defined")
    return types


def full_name(name: str, package: str) -> str:
    """Return a type's name as ``package/Name``.

    Examples
    --------
    >>> full_name("sensor_msgs/msg/Imu", ""), full_name("Vector3", "geometry_msgs"), full_name("Header", "sensor_msgs")
    ('sensor_msgs/Imu', 'geometry_msgs/Vector3', 'std_msgs/Header')
    """
    parts = [part for part in name.split("/") if part not in ("msg", "")]
    if len(parts) > 1:
        return f"{parts[0]}/{parts[-1]}"
    if name in ("time", "duration"):
        return f"builtin_interfaces/{name.capitalize()}"
    return f"{'std_msgs' if name == 'Header' else package}/{name}" if package or name == "Header" else name


def _fields(text: str, package: str) -> tuple[Field, ...]:
    fields = []
    for line in text.splitlines():
        content = line.partition("#")[0].strip()
        if not content:
            continue
        match = _FIELD.match(content)
        if match is None:
            raise NoReaderError(f"its definition has a line that is no field: {content[:80]!r}")
        if match["rest"].startswith("="):
            continue  # a constant
        kind = match["type"]
        if kind not in PRIMITIVES and kind not in ("string", "wstring"):
            kind = full_name(kind, package)
        array = match["array"]
        count = None if array is None else -1 if array == "[]" or array.startswith("[<=") else int(array[1:-1])
        fields.append(Field(match["name"], kind, count))
    return tuple(fields)
