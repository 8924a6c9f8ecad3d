"""What a profile maps: checked, and for NMEA logs as factors and offsets."""

from __future__ import annotations

from kempf.schemas.channels import CHANNELS
from kempf.schemas.errors import UsageError
from kempf.schemas.nmea import SENTENCES, SPECIAL
from kempf.schemas.profile import ChannelMap, Source
from kempf.schemas.units import factor_to_si


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


def nmea_corrections(name: str, source: Source | None) -> dict[str, dict[str, tuple[float, float]]]:
    """Return what a profile corrects in an NMEA log, whose sentences fix channel and unit.

    Parameters
    ----------
    name : str
        Name of the file, for messages.
    source : Source or None
        What the profile says of the log: a key such as ``AGRSA.rudder_angle`` gives that sentence's value another unit,
        sign or offset.

    Returns
    -------
    dict
        Channel -> address of the sentence -> factor on the value in SI, and offset in SI.

    Raises
    ------
    UsageError
        A key of the source is not of that form, or maps to another channel.
    """
    corrections: dict[str, dict[str, tuple[float, float]]] = {}
    if source is None or (source.time is not None and not (source.time.start and not source.time.columns)):
        # a source with a time column describes delimited text that happens to share the pattern
        return corrections
    for key, mapped in source.channels.items():
        address, _, channel = key.partition(".")
        units = {f.channel: f.unit for f in SENTENCES[address[2:]].fields} if address[2:] in SENTENCES else {}
        units |= SPECIAL.get(address[2:], {})
        if channel not in units or mapped.channel != channel:
            raise UsageError(
                "nmea_key_unknown",
                f"{name} is an NMEA log, whose sentences fix channel and unit; the profile's key {key!r} for "
                f"{mapped.channel} fits none of them.",
                "Leave the channels of the source out, or write '<talker and sentence>.<channel>' such as "
                "'AGRSA.rudder_angle', with that same channel, to correct its sign, unit or offset.",
                {"name": name, "key": key},
            )
        factor = mapped.factor / factor_to_si(units[channel], CHANNELS[channel].unit, key)
        corrections.setdefault(channel, {})[address] = (factor, mapped.offset_si)
    return corrections
