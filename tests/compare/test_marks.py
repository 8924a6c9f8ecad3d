"""The instants at which evidence shows are those at which it was put in."""

from __future__ import annotations

from itertools import product

import numpy as np

from kempf.pipeline.compare.correlations import given_to
from kempf.pipeline.compare.evidence import ITSELF, evidence_in
from kempf.pipeline.compare.marks import MARKED, marks
from kempf.pipeline.compare.misfit import where
from kempf.pipeline.estimate.record.record import MEASUREMENTS
from kempf.pipeline.predict.run_residuals import RunResiduals
from tests.compare.test_where import RUN, looked


def late(*seeds: int) -> list[RunResiduals]:
    return [looked(seed, late_s=4 * RUN.step_s, name=f"seg-{seed}") for seed in seeds]


def test_a_group_shows_at_its_instants():
    runs = late(1, 2)
    evidence = evidence_in({"fitted": where(runs), "held_out": None})
    assert len({one.key for one in evidence}) == len(evidence)
    found = marks(runs, evidence)
    phases = [one for one in evidence if one.of == "by_phase"]
    assert {one.which for one in phases} >= {"steady_yaw"}
    for run, one in product(runs, phases):
        np.testing.assert_array_equal(found[one.key][run.filtered.run.name], run.phase_of == one.which)


def test_a_tenth_of_the_instants_makes_most_of_a_correlation():
    runs = late(1, 2, 3)
    evidence = [one for one in evidence_in({"fitted": None, "held_out": where(runs)}) if one.of == "correlation"]
    assert {one.which for one in evidence} > {ITSELF}
    for one in evidence:
        marked = marks(runs, [one])[one.key]
        parts, lag = [], round(one.lag_s / RUN.step_s)
        for run in runs:
            z = run.whitened[:, MEASUREMENTS.index(one.channel)]
            given = z if one.which == ITSELF else given_to(run.filtered.run)[one.which]
            parts.append(np.concatenate([np.full(lag, np.nan), z[lag:] * given[: given.size - lag]]))
        inside, each = np.concatenate(list(marked.values())), np.concatenate(parts)
        assert abs(np.mean(inside) - MARKED) < 0.02
        # a tenth taken by chance would make a tenth of it
        assert np.nansum(each[inside]) / np.nansum(each) > 2.0 * MARKED


def test_what_is_as_unlikely_takes_turns():
    kinds = [one.of.partition(" ")[0] for one in evidence_in({"fitted": where(late(1, 2, 3)), "held_out": None})[:3]]
    assert len(set(kinds)) == 3


def test_power_in_a_band_shows_at_no_instant():
    runs = late(1, 2, 3)
    evidence = [one for one in evidence_in({"fitted": where(runs), "held_out": None}) if one.of == "band"]
    assert evidence and marks(runs, evidence) == {}
