"""Encodings of messages that are not read: which, and how a log gets one that is.

References
----------
MCAP registry, https://mcap.dev/spec/registry, "Well-known message encodings" and "Well-known schema encodings".
"""

from __future__ import annotations

from collections.abc import Mapping

from kempf.pipeline.ingest.mcap.records import Schema
from kempf.pipeline.ingest.messages.columns import NoReaderError
from kempf.schemas.errors import DataRejected

_READ = "JSON, CDR with definitions in ros2msg, and protobuf are read"

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
_OF_OTHERS = "Let the logger write these topics in one of them."


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
        step = _OF_OTHERS
        if encoding == "cdr":
            step = _OF_IDL if schema and schema.encoding == "ros2idl" else _OF_NO_DEFINITION
        return NoReaderError(f"is encoded as {encoding} with {described}; {_READ}", step)
    step = _OF_ROS_1 if encoding == "ros1" else _OF_OTHERS
    return NoReaderError(f"is encoded as {encoding or 'nothing that is named'}; {_READ}", step)


def unreadable(name: str, refused: Mapping[str, NoReaderError]) -> DataRejected:
    """Return the error of a log of which no topic that is asked for can be read.

    Parameters
    ----------
    name : str
        Name of the log.
    refused : mapping of str to NoReaderError
        By topic.
    """
    said = " ".join(f"Topic {topic} {why}." for topic, why in sorted(refused.items()))
    steps = dict.fromkeys(why.next_step for why in refused.values() if why.next_step)
    return DataRejected(
        "topics_unreadable",
        f"{name} holds no valid reading, for no topic that is asked for can be read. {said}",
        " ".join(steps)
        or "Correct the keys '<topic>.<field>' in the profile's source, or let the logger write other messages.",
        {"name": name, "topics": sorted(refused)},
    )
