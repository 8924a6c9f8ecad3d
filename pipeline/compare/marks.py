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
from kempf.pipeline.estimate.record.record import MEASUREMENTS
from kempf.pipeline.predict.run_residuals import RunResiduals, Samples, samples_of

#: share of the instants of a sample that contribute most to a correlation
MARKED = 0.1


def marks(residuals: Sequence[RunResiduals], evidence: Sequence[Evidence]) -> dict[str, dict[str, Mask]]:
    """Return the instants at which evidence shows.

    Parameters
    ----------
    residuals : sequence of RunResiduals
        All runs of a sample; at least one.
    evidence : sequence of Evidence
        Of that sample.

    Returns
    -------
    dict of str to dict
        By `Evidence.key` and run, shape (n,) each. What shows at no instants of its own, such as power in a band of
        frequencies, is left out.
    """
    samples, masks = samples_of(residuals), {}
    names = [run.filtered.run.name for run in residuals]
    ends = np.cumsum([run.filtered.run.time_s.size for run in residuals])
    for finding in evidence:
        inside = _contributing(residuals, finding) if finding.of == "correlation" else _group(samples, finding)
        if inside is not None:
            masks[finding.key] = dict(zip(names, np.split(inside, ends[:-1]), strict=True))
    return masks


def _group(samples: Samples, finding: Evidence) -> Mask | None:
    """Return the instants of a group, shape (N,); None where it is none of instants."""
    if finding.of.startswith("by_bin "):
        intervals = bins(samples)[finding.of.removeprefix("by_bin ")]
        return next(b.inside for b in intervals if b.words == finding.which)
    groups = {"by_phase": phases, "by_side": sides, "by_run": runs}.get(finding.of)
    return None if groups is None else groups(samples)[finding.which]


def _contributing(residuals: Sequence[RunResiduals], finding: Evidence) -> Mask:
    """Return the instants that contribute most to a correlation, shape (N,)."""
    parts = []
    for run in residuals:
        z = run.whitened[:, MEASUREMENTS.index(finding.channel)]
        other = z if finding.which == ITSELF else given_to(run.filtered.run)[finding.which]
        lag = round(finding.lag_s / run.filtered.run.step_s)
        part = np.full(z.size, np.nan)
        part[lag:] = z[lag:] * other[: other.size - lag]
        parts.append(part)
    product: Float = np.concatenate(parts)
    product *= np.sign(np.nansum(product))
    known: Mask = np.isfinite(product)
    if known.any():
        known &= product >= np.quantile(product[known], 1.0 - MARKED)
    return known
