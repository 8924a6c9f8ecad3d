"""At which instants what speaks against a model shows, so that a reader can look at them.

Of a group these are its instants. A correlation is a sum over instants: those are marked that contribute most to it.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kempf.pipeline.channels.series import Float, Mask
from kempf.pipeline.compare.bins import bins, phases, runs, sides
from kempf.pipeline.compare.correlations import given_to
from kempf.pipeline.compare.evidence import ITSELF, Evidence
from kempf.pipeline.predict.free_run import CHANNELS
from kempf.pipeline.predict.run_residuals import Looked, Samples, samples_of

#: share of the instants of a sample that contribute most to a correlation
MARKED = 0.1


def marks(looked: Sequence[Looked], evidence: Sequence[Evidence]) -> dict[str, dict[str, Mask]]:
    """Return the instants at which evidence shows.

    Parameters
    ----------
    looked : sequence of Looked
        All runs of a sample; at least one.
    evidence : sequence of Evidence
        Of that sample.

    Returns
    -------
    dict of str to dict
        By `Evidence.key` and run, shape (n,) each. What shows at no instants of its own, such as power in a band of
        frequencies, is left out.
    """
    samples, found = samples_of(looked), {}
    names = [one.filtered.run.name for one in looked]
    ends = np.cumsum([one.filtered.run.time_s.size for one in looked])
    for one in evidence:
        inside = _contributing(looked, one) if one.of == "correlation" else _group(samples, one)
        if inside is not None:
            found[one.key] = dict(zip(names, np.split(inside, ends[:-1]), strict=True))
    return found


def _group(samples: Samples, one: Evidence) -> Mask | None:
    """Return the instants of a group, shape (N,); None where it is none of instants."""
    if one.of.startswith("by_bin "):
        made = bins(samples)[one.of.removeprefix("by_bin ")]
        return next(b.inside for b in made if b.words == one.which)
    groups = {"by_phase": phases, "by_side": sides, "by_run": runs}.get(one.of)
    return None if groups is None else groups(samples)[one.which]


def _contributing(looked: Sequence[Looked], one: Evidence) -> Mask:
    """Return the instants that contribute most to a correlation, shape (N,)."""
    parts = []
    for run in looked:
        z = run.whitened[:, CHANNELS.index(one.channel)]
        other = z if one.which == ITSELF else given_to(run.filtered.run)[one.which]
        lag = round(one.lag_s / run.filtered.run.step_s)
        part = np.full(z.size, np.nan)
        part[lag:] = z[lag:] * other[: other.size - lag]
        parts.append(part)
    product: Float = np.concatenate(parts)
    product *= np.sign(np.nansum(product))
    known: Mask = np.isfinite(product)
    if known.any():
        known &= product >= np.quantile(product[known], 1.0 - MARKED)
    return known
