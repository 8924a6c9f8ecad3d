"""What the errors of a model go with, the least likely of a right model first, a sentence each."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from kempf.schemas.enumeration import as_words

#: probability below which something is said, and how many are
LEVEL, MOST = 0.01, 12
#: samples with their words, the more telling first
SAMPLES = (("held_out", "held out"), ("fitted", "fitted"))
#: what an error that resembles itself goes with
ITSELF = "itself"


@dataclass(frozen=True)
class Evidence:
    """One thing that a right model would hardly leave."""

    words: str
    #: ``held_out`` or ``fitted``.
    sample: str
    #: Of the errors.
    channel: str
    #: What they are grouped by, see ``of`` of `kempf.pipeline.compare.misfit.where`; ``correlation`` or ``band``.
    of: str
    #: Group, or what the errors go with.
    which: str
    #: Probability of as much with a right model, for as many as were looked at.
    probability: float
    #: How long before the error, s; 0 in a group.
    lag_s: float = 0.0
    #: By which things of one kind are in order where the probability is too small for a number.
    strength: float = 0.0

    @property
    def key(self) -> str:
        """A name for addresses; no other evidence of the same model has it."""
        return re.sub(r"[^a-z0-9.-]+", "_", f"{self.sample} {self.of} {self.which} {self.channel}".lower())


def evidence_in(where: Mapping[str, Any]) -> list[Evidence]:
    """Return what speaks against a model.

    Parameters
    ----------
    where : mapping
        See `kempf.pipeline.compare.misfit.where`, by sample; None where there are no such manoeuvres.
    """
    evidence = [
        finding for sample, _ in SAMPLES if where[sample] is not None for finding in _of_sample(sample, where[sample])
    ]
    evidence.sort(key=lambda finding: (finding.probability, -finding.strength))
    # of what is as unlikely, something of every kind before the second of one
    seen: Counter[tuple[float, str]] = Counter()
    places = []
    for finding in evidence:
        kind = (finding.probability, ITSELF if finding.which == ITSELF else finding.of.partition(" ")[0])
        places.append((finding.probability, seen[kind]))
        seen[kind] += 1
    order = sorted(range(len(evidence)), key=lambda k: places[k])
    return [evidence[k] for k in order[:MOST]]


def _of_sample(sample: str, misfit: Mapping[str, Any]) -> Iterator[Evidence]:
    for entry in misfit["stands_out"]:
        of, which, channel = entry["of"], str(entry["which"]), entry["channel"]
        yield Evidence(
            f"errors of {as_words(channel)} are {entry['whitened_rms']:.2f} times as large as the model says: "
            f"{as_words(of.removeprefix('by_').removeprefix('bin '))} {as_words(which)}",
            *(sample, channel, of, which, float(entry["p_adjusted"])),
            strength=entry["n"] * entry["whitened_rms"] ** 2,
        )
    for channel, entry in misfit["correlations"].items():
        own = entry["auto"]["p_value"]
        if own is not None and own < LEVEL:
            words = f"errors of {as_words(channel)} one step ahead are correlated in time"
            lag_s = float(entry["auto"]["largest_lag_s"] or 0.0)
            rho = abs(entry["auto"]["largest"] or 0.0)
            yield Evidence(words, sample, channel, "correlation", ITSELF, float(own), lag_s, rho)
        for name, cross in entry["cross"].items():
            if cross["largest"] is not None and cross["p_adjusted"] < LEVEL:
                words = (
                    f"errors of {as_words(channel)} go with {as_words(name)}, {cross['largest_lag_s']:g} s before: "
                    f"correlation {cross['largest']:+.2f}"
                )
                p, lag_s = float(cross["p_adjusted"]), float(cross["largest_lag_s"])
                yield Evidence(words, sample, channel, "correlation", name, p, lag_s, abs(cross["largest"]))
    count = sum(len(bands) for bands in misfit["by_band"].values())
    for channel, bands in misfit["by_band"].items():
        out = [band for band in bands if count * band["p_value"] < LEVEL]
        if out:
            most = max(out, key=lambda band: float(band["ratio"]))
            bounds = f"{most['low_hz']:g} and {most['high_hz']:g} Hz"
            words = (
                f"errors of {as_words(channel)} have {most['ratio']:.1f} times the power of white noise between "
                f"{bounds}"
            )
            p = min(1.0, float(count * most["p_value"]))
            yield Evidence(words, sample, channel, "band", bounds, p, strength=float(most["ratio"]))
