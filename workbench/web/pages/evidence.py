"""What the errors of a model go with, the least likely of a right model first, a sentence each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

#: probability below which something is said, and how many are
LEVEL, MOST = 0.01, 12


@dataclass(frozen=True)
class Evidence:
    """One thing that a right model would hardly leave."""

    words: str
    #: ``held out`` or ``fitted``.
    sample: str
    #: Probability of as much with a right model, for as many as were looked at.
    probability: float


def evidence_in(where: Mapping[str, Any], samples: tuple[tuple[str, str], ...]) -> list[Evidence]:
    """Return what speaks against a model.

    Parameters
    ----------
    where : mapping
        See `kempf.pipeline.compare.misfit.where`, by sample; None where there are no such manoeuvres.
    samples : tuple of (str, str)
        Keys of the samples with their words, the more telling first.
    """
    found = [
        Evidence(said, words, float(probability))
        for key, words in samples
        if where[key] is not None
        for said, probability in _said(where[key])
    ]
    return sorted(found, key=lambda one: one.probability)[:MOST]


def _said(one: Mapping[str, Any]) -> Iterator[tuple[str, float]]:
    for entry in one["stands_out"]:
        of = entry["of"].removeprefix("by_").removeprefix("bin ")
        place = f"{of.replace('_', ' ')} {str(entry['which']).replace('_', ' ')}"
        yield (
            f"errors of {_words(entry['channel'])} are {entry['whitened_rms']:.2f} times as large as the model says: "
            f"{place}",
            entry["p_adjusted"],
        )
    for channel, entry in one["correlations"].items():
        own = entry["auto"]["p_value"]
        if own is not None and own < LEVEL:
            yield f"errors of {_words(channel)} one step ahead are correlated in time", own
        for name, cross in entry["cross"].items():
            if cross["largest"] is not None and cross["p_adjusted"] < LEVEL:
                yield (
                    f"errors of {_words(channel)} go with {_words(name)}, {cross['largest_lag_s']:g} s before: "
                    f"correlation {cross['largest']:+.2f}",
                    cross["p_adjusted"],
                )
    count = sum(len(bands) for bands in one["by_band"].values())
    for channel, bands in one["by_band"].items():
        out = [band for band in bands if count * band["p_value"] < LEVEL]
        if out:
            most = max(out, key=lambda band: float(band["ratio"]))
            yield (
                f"errors of {_words(channel)} have {most['ratio']:.1f} times the power of white noise between "
                f"{most['low_hz']:g} and {most['high_hz']:g} Hz",
                min(1.0, count * most["p_value"]),
            )


def _words(name: str) -> str:
    return name.replace("_", " ")
