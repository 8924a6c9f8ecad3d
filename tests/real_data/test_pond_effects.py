"""A tanker model on a windy pond lacks three effects that hide each other: what predictions of legs say of her."""

from __future__ import annotations

import numpy as np
import pytest

from kempf.flows.jobs.diagnose.diagnose_vessel import examine
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN, known_effects
from kempf.flows.jobs.identify.vessel_runs import assembled
from kempf.flows.process.progress import silent
from kempf.pipeline.diagnose.split import split
from kempf.pipeline.diagnose.steps.improves_prediction import better_ahead
from kempf.pipeline.diagnose.steps.joint import better_together
from kempf.pipeline.diagnose.steps.ladder_step import rung
from kempf.pipeline.diagnose.verdicts.sentences import sentences
from kempf.pipeline.diagnose.verdicts.verdict import verdict
from kempf.pipeline.shooting.ahead import shooting_range
from kempf.workbench.rungs import compared
from tests.diagnose.sailing import WORKERS
from tests.real_data.voyage import Voyage


def test_wind_race_and_drag_are_found_together_where_none_is_alone(pond: Voyage) -> None:
    vessel = pond.ship.name
    spec = default_model_of(pond.warehouse, vessel)
    runs = assembled(pond.warehouse, choose(pond.warehouse, vessel), spec, silent).runs
    fitted, held = split(runs)
    shooting = shooting_range([runs[i] for i in fitted], [runs[i] for i in held], spec, WORKERS)
    channels = set.intersection(*(set(run.channels) for run in runs))
    effects = [e for e in known_effects(NONE_OF_ONES_OWN).values() if set(e.needs) <= channels]
    assert better_ahead(shooting, shooting.plain, effects) is None
    found = better_together(shooting, shooting.plain, effects)
    assert found is not None
    assert {effect.name for effect in found.effects[:-1]} == {"wind_force", "propeller_wash"}
    assert found.alternatives[0].name == "cross_flow_drag"
    assert all(effect.group == "hull" for effect in found.alternatives)


def test_her_diagnosis_names_the_three_with_sizes_that_predict(pond: Voyage) -> None:
    vessel = pond.ship.name
    spec = default_model_of(pond.warehouse, vessel)
    chosen = choose(pond.warehouse, vessel)
    some = ("wind_force", "propeller_wash", "cross_flow_drag", "yaw_vr2")
    diagnosis = examine(pond.warehouse, chosen, spec, NONE_OF_ONES_OWN, only=some).diagnosis
    names = tuple(step.added.name for step in diagnosis.steps[1:] if step.added is not None)
    assert names == ("propeller_wash", "wind_force", "cross_flow_drag")
    assert all(step.together == names for step in diagnosis.steps[1:])
    # whether or not one step ahead anything still shows: fits one step and one leg ahead disagree
    said = sentences(diagnosis)
    assert verdict(diagnosis) == "partly_explained"
    assert any("still disagree" in line for line in said)
    assert any("None of the known effects explains what remains" in line for line in said) is diagnosis.something_left
    (together,) = (line for line in said if "belong together" in line)
    assert together.startswith("Propeller race over the rudder, force and moment of the wind and cross-flow drag")
    # one step ahead disturbances carry all three: the sizes are those that predict legs
    assert sum(", fitted to legs" in line for line in said) == 3
    first, last = diagnosis.steps[0].ahead, diagnosis.steps[-1].ahead
    assert first is not None and last is not None
    assert last.own.mean < 0.5 * first.own.mean and last.left_out.mean < 0.6 * first.left_out.mean
    assert last.held.mean < 0.3 * first.held.mean
    # what a user sees fall: free runs with the parameters that predictions take
    assert diagnosis.steps[-1].predicts_by_legs
    rungs = compared([rung(number, step) for number, step in enumerate(diagnosis.steps)])
    assert all(one.by_legs for one in rungs)
    fitted, held = [one.free.fitted for one in rungs], [one.free.held_out for one in rungs]
    assert fitted[-1] is not None and fitted[0] is not None and fitted[-1] < 0.6 * fitted[0]
    assert held[-1] is not None and held[0] is not None and held[-1] < 0.6 * held[0]
    (drag,) = rungs[-1].sizes
    assert drag.name == "c" and drag.value == last.fit.values[-1] and drag.std == pytest.approx(last.std[-1])
    (free,) = (line for line in said if "median free-run error" in line)
    assert "in held-out manoeuvres" in free
    before, after = (np.median([run.relative_error for run in step.by_legs]) for step in diagnosis.steps[::3])
    assert after < 0.8 * before < 0.8 * np.median([run.relative_error for run in diagnosis.steps[0].fitted])
