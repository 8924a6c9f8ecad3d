"""The refusal of an MCAP log of which the profile asks for nothing, and what to write into it."""

from __future__ import annotations

from collections.abc import Sequence

from kempf.pipeline.ingest.mcap.topics import sentences
from kempf.schemas.errors import UsageError

#: Topics that are named in a message to a person, at most.
NAMED = 20


def unmapped(
    name: str,
    topics: Sequence[str],
    patterns: Sequence[str],
    *,
    fits: bool,
    offers: Sequence[str],
    spoken: Sequence[str],
) -> UsageError:
    """Return the error.

    Parameters
    ----------
    name : str
        Name of the log.
    topics : sequence of str
        All topics of the log.
    patterns : sequence of str
        Those of the profile's sources.
    fits : bool
        Whether one of them fits the name.
    offers : sequence of str
        Lines for the profile, right if axes are those of REP-103.
    spoken : sequence of str
        Topics that hold NMEA sentences.
    """
    found, step = "for which the profile maps no topic", ""
    if patterns and not fits:
        found = f"and its name fits no pattern of the profile's sources, which are {', '.join(map(repr, patterns))}"
        step = "Correct `match` of the source that is meant, such as to '*.mcap*', or give the profile of this log. "
    if spoken:
        step += f"{sentences.NEXT_STEP} For the other topics "
    drafted = f"`kempf profile draft {name}` writes a source to complete, which maps '<topic>.<field>' to channels. "
    axes = f" With axes as in REP-103: {' '.join(offers)}." if offers else ""
    return UsageError(
        "no_source_for_log",
        f"{name} is an MCAP file, {found}; its topics are {', '.join(topics[:NAMED]) or 'none'}."
        + (f" {sentences.about(spoken)}" if spoken else ""),
        f"{step}{drafted}See docs/profile.md.{axes}",
        {"name": name, "topics": list(topics), "patterns": list(patterns)},
    )
