"""Checks of what a profile maps, shared by the formats that need a profile."""

from __future__ import annotations

from kempf.schemas.errors import UsageError
from kempf.schemas.profile import ChannelMap


def check_once(name: str, channels: dict[str, ChannelMap]) -> None:
    """Refuse a map that gives one channel of one record two values.

    Parameters
    ----------
    name : str
        File or topic, for the message.
    channels : dict of str to ChannelMap
        Columns or fields of one record.

    Raises
    ------
    UsageError
        Two of them map to one channel.
    """
    keys: dict[str, list[str]] = {}
    for key, mapped in channels.items():
        keys.setdefault(mapped.channel, []).append(key)
    for channel, twice in keys.items():
        if len(twice) > 1:
            raise UsageError(
                "channel_mapped_twice",
                f"The profile maps {' and '.join(map(repr, twice))} of {name} to {channel}: "
                "a record holds one value of it.",
                "Keep the better one of them.",
                {"name": name, "channel": channel, "keys": twice},
            )
