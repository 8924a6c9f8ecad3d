"""The NMEA 0183 log of a simulated trial, sentence by sentence, and behind other stamps than those of arrival."""

from __future__ import annotations

import gzip
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import floor

import numpy as np

from kempf.pipeline.simulate.nmea_log import checksum, to_nmea
from kempf.pipeline.simulate.trial import Trial


@dataclass(frozen=True)
class Sentence:
    """What an instrument says."""

    #: When it arrives, UTC s.
    at_s: float
    #: Between ``$`` and ``*``.
    body: str


#: Returns what stands in front of a sentence that arrives then, UTC s.
Stamp = Callable[[float], str]
#: How far behind the whole second a logger that looks once a second does so, s.
_LOOKS_S = 0.63


def sentences_of(trial: Trial) -> list[Sentence]:
    """Return the log as it should be."""
    lines = gzip.decompress(to_nmea(trial, damaged_share=0.0)).decode("ascii").split("\r\n")[:-1]
    stamps = np.array([line[:23] for line in lines], dtype="datetime64[ms]").astype(np.int64)
    return [Sentence(ms / 1e3, line[26:-3]) for ms, line in zip(stamps.tolist(), lines, strict=True)]


def written(log: Sequence[Sentence], stamp: Stamp | None) -> bytes:
    """Write sentences in the order in which they arrive, behind their stamps where there are any."""
    lines = [
        f"{stamp(one.at_s) if stamp else ''}${one.body}*{checksum(one.body)}"
        for one in sorted(log, key=lambda one: one.at_s)
    ]
    return "\r\n".join([*lines, ""]).encode("ascii")


def restamped(trial: Trial, stamp: Stamp | None) -> bytes:
    """Return the log of a trial behind other stamps, or without any."""
    return written(sentences_of(trial), stamp)


def iso(at_s: float) -> str:
    """Stamp a sentence with the instant of its arrival."""
    return f"{np.datetime64(round(at_s * 1e3), 'ms')}Z "


def whole_second(at_s: float) -> str:
    """Stamp it with the second in which it arrives."""
    return iso(floor(at_s))


def burst(at_s: float) -> str:
    """Stamp it with the instant at which a logger that looks once a second finds it."""
    return iso(floor(at_s - _LOOKS_S) + 1.0 + _LOOKS_S)
