"""Encodings of messages that are not read: which, and how a log gets one that is.

References
----------
MCAP registry, https://mcap.dev/spec/registry, "Well-known message encodings" and "Well-known schema encodings".
"""

from __future__ import annotations

from kempf.pipeline.ingest.mcap.container.records import Schema
from kempf.pipeline.ingest.messages.columns import NoReaderError

_READ = "JSON, CDR and protobuf are read"

#: What to do, by how messages or their definitions are written.
_OF_ROS_1 = (
    "Convert the bag of ROS 1 to MCAP with messages of ROS 2: `rosbags-convert --src BAG --dst NEW --dst-storage mcap` "
    "(of the Python package rosbags)."
)
_OF_IDL = (
    "Record the numbers in messages that .msg files define, or write them to a log in JSON or to delimited text, with "
    "the Python package mcap-ros2idl-support for example."
)
_OF_NO_DEFINITION = (
    "The recorder did not find the definition of the messages: record where their package is installed and sourced, or "
    "run `ros2 bag convert` there, which writes the definitions into the file."
)
_OF_OTHERS = "Let the logger write these topics in JSON, CDR (ROS 2) or protobuf, with their definitions."


def unread(encoding: str, schema: Schema | None) -> NoReaderError:
    """Return why messages of an encoding cannot be read.

    Parameters
    ----------
    encoding : str
        Of the messages.
    schema : Schema or None
        Their definition.
    """
    if encoding == "cdr" and schema is not None and schema.encoding == "ros2msg":
        why = f"is encoded as cdr, and the definition of its messages, {schema.name}, is empty in the file"
        return NoReaderError(why, _OF_NO_DEFINITION)
    if encoding in ("cdr", "protobuf"):
        described = f"a schema in {schema.encoding}" if schema and schema.encoding else "no schema"
        if encoding == "protobuf":
            return NoReaderError(
                f"is encoded as protobuf with {described}; it is read with one in protobuf", _OF_OTHERS
            )
        step = _OF_IDL if schema and schema.encoding == "ros2idl" else _OF_NO_DEFINITION
        return NoReaderError(f"is encoded as cdr with {described}; it is read with one in ros2msg", step)
    step = _OF_ROS_1 if encoding == "ros1" else _OF_OTHERS
    return NoReaderError(f"is encoded as {encoding or 'nothing that is named'}; {_READ}", step)
