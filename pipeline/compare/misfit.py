"""Where a model fails: by phase of the manoeuvre, side, what the ship did, run and frequency; the worst windows.

Never fitted and held-out runs in one call: what was fitted says less of the model.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from kempf.pipeline.compare.bands import by_band
from kempf.pipeline.compare.bins import Bin, binned, bins, grouped, phases, runs, sides
from kempf.pipeline.compare.correlations import correlations
from kempf.pipeline.compare.group import BAND
from kempf.pipeline.compare.worst_windows import worst
from kempf.pipeline.distributions import chi2_log_tail, chi2_tail
from kempf.pipeline.predict.run_residuals import RunResiduals, samples_of

#: how many groups are named as those that stand out
_NAMED = 6


def where(residuals: Sequence[RunResiduals]) -> dict[str, Any]:
    """Say where a model fails.

    Parameters
    ----------
    residuals : sequence of RunResiduals
        All fitted, or all held out; at least one.

    Returns
    -------
    dict
        ``band_probability``; ``by_phase``, ``by_side``, ``by_bin``, ``by_run`` (see `pipeline.compare.group.group`),
        ``by_band``, ``correlations``, ``worst``, and ``stands_out``: the groups whose whitened innovations are larger
        than a right model leaves in any of so many groups with probability 99 % (Bonferroni), the least likely first,
        with ``of``, ``which``, ``channel``, ``n``, ``whitened_rms``, ``band``, ``p_adjusted``.
    """
    samples = samples_of(residuals)
    groups = {"by_phase": grouped(samples, phases(samples)), "by_side": grouped(samples, sides(samples))}
    of_bins, of_runs = bins(samples), grouped(samples, runs(samples))
    by_bin = binned(samples, of_bins)
    return {
        "band_probability": BAND,
        **groups,
        "by_bin": by_bin,
        "by_run": of_runs,
        "by_band": by_band(residuals),
        "correlations": correlations(residuals),
        "worst": worst(residuals),
        "stands_out": _stands_out({**groups, "by_run": of_runs}, of_bins, by_bin),
    }


def _stands_out(
    named: dict[str, dict[str, Any]], of_bins: dict[str, list[Bin]], by_bin: dict[str, list[dict[str, Any]]]
) -> list[dict[str, Any]]:
    entries = [(of, which, group) for of, groups in named.items() for which, group in groups.items()]
    for name, groups in by_bin.items():
        entries += [(f"by_bin {name}", b.words, group) for b, group in zip(of_bins[name], groups, strict=True)]
    tested = [(of, which, *pair) for of, which, group in entries for pair in group["channels"].items() if pair[1]["n"]]
    rows = []
    for of, which, channel, reading in tested:
        square = reading["n"] * reading["whitened_rms"] ** 2
        adjusted = min(1.0, len(tested) * chi2_tail(square, reading["n"]))
        if adjusted < 1.0 - BAND:
            kept = {key: reading[key] for key in ("n", "whitened_rms", "band")}
            rank = chi2_log_tail(square, reading["n"])
            rows.append((rank, {"of": of, "which": which, "channel": channel, **kept, "p_adjusted": adjusted}))
    return [entry for _, entry in sorted(rows, key=lambda pair: pair[0])[:_NAMED]]
