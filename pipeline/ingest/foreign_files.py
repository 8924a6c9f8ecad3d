"""Files that are handed over for a log now and then and are none, by how they begin, each with what to do."""

from __future__ import annotations

from dataclasses import dataclass

#: How the file begins that rosbag2 writes beside those of a bag.
BAG_DESCRIPTION = b"rosbag2_bagfile_information:"

_EXPORT = "Give the log that the logger wrote, or export it as one of these."
_OF_ROS_1 = (
    "Convert it to MCAP with messages of ROS 2, which are read: `rosbags-convert --src LOG.bag --dst LOG --dst-storage "
    "mcap` (of the Python package rosbags)."
)
_OF_SQLITE = (
    "If it is a bag of ROS 2, convert it to MCAP: `mcap convert LOG.db3 LOG.mcap` where the messages are installed, or "
    "`ros2 bag convert`. Export any other database as delimited text."
)


@dataclass(frozen=True)
class ForeignFile:
    """A file of a kind that is known and no log."""

    description: str
    next_step: str = _EXPORT


_KNOWN = (
    (b"%PDF-", ForeignFile("a PDF document")),
    (b"PK\x03\x04", ForeignFile("a zip archive, as a workbook (.xlsx) is")),
    (b"\x89PNG\r\n", ForeignFile("a PNG picture")),
    (b"\xff\xd8\xff", ForeignFile("a JPEG picture")),
    (b"\xd0\xcf\x11\xe0", ForeignFile("an old Office document")),
    (b"{\\rtf", ForeignFile("an RTF document")),
    (b"#ROSBAG V", ForeignFile("a bag of ROS 1", _OF_ROS_1)),
    (b"SQLite format 3\0", ForeignFile("an SQLite database, as a bag of ROS 2 (.db3) is", _OF_SQLITE)),
    (BAG_DESCRIPTION, ForeignFile("the description of a bag of ROS 2", "Give the .mcap file beside it.")),
)

#: Where a tar archive says that it is one.
_TAR, _TAR_AT = b"ustar", 257


def foreign_file(data: bytes) -> ForeignFile | None:
    """Return what a file is that is known and no log; None for any other.

    Parameters
    ----------
    data : bytes
        Unpacked content, or the beginning of it.

    Examples
    --------
    >>> foreign_file(b"%PDF-1.7 trial report").description
    'a PDF document'
    """
    if data.startswith(_TAR, _TAR_AT):
        return ForeignFile("a tar archive")
    return next((one for begin, one in _KNOWN if data.startswith(begin)), None)
