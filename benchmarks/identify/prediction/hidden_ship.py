"""A ship with an effect that the plain model lacks, sailed by the plant of the hidden cases on her two days.

Her logs go through the whole job: read, zigzags found, the effect named by the diagnosis or given, added to her model
as `kempf effects add` does it, and predicted. Effects that sit in an instrument do not move a ship; waves, shallow
water and roll have no part in a manoeuvre that is predicted for calm, deep water and a ship upright.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import isfinite
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks.diagnose.hidden_effects import plant, programme
from benchmarks.diagnose.hidden_effects.cases import Case
from benchmarks.diagnose.hidden_effects.effects import CATALOGUE, SHARES, theta
from benchmarks.diagnose.hidden_effects.sail import VoyageFailed
from benchmarks.diagnose.hidden_effects.taken_in import taken_in
from benchmarks.diagnose.hidden_effects.write import logs_of
from benchmarks.identify.prediction.calm_water import sailed, truth_of
from benchmarks.identify.prediction.compared import RUDDERS_DEG, ComparedShip, Truth, predicted_beside
from benchmarks.identify.prediction.plain_ship import slides
from kempf.flows.jobs.diagnose.add_effect import add_effect
from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_vessel
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN
from kempf.pipeline.channels.series import Float
from kempf.pipeline.simulate.hulls import HULLS, SimulatedHull
from kempf.pipeline.simulate.random_streams import stream
from kempf.schemas.errors import DataRejected, KempfError
from kempf.schemas.model_spec import ModelSpec

_SEED = 20261125
_ASIDE = ("waves", "shallow_water", "roll_coupling")
#: The effects that take turns.
EFFECTS = tuple(name for name, one in CATALOGUE.items() if not one.sensor and name not in _ASIDE)


def compared(number: int, *, diagnosed: bool) -> ComparedShip:
    """Predict one ship and compare her with the plant's.

    Parameters
    ----------
    diagnosed : bool
        Whether a diagnosis has to find the effect; else it is given.
    """
    case, hull, truth, files = next(_ships(number))
    kind = "diagnosed" if diagnosed else "known"
    with TemporaryDirectory() as place:
        warehouse = taken_in(files, Path(place))
        if diagnosed:
            stored, _ = diagnose_vessel(warehouse, case.case_id, ModelSpec())
            if case.effect not in stored.effects:
                return ComparedShip(kind, case.case_id, case.effect, (), (), found=False)
        try:
            add_effect(warehouse, case.case_id, case.effect, begin=(ModelSpec(), NONE_OF_ONES_OWN))
        except KempfError as error:
            return ComparedShip(kind, case.case_id, case.effect, (), (error.message,))
        figures, refused, models = predicted_beside(warehouse, case.case_id, hull.trial_speed_m_s, truth)
    return ComparedShip(kind, case.case_id, case.effect, figures, refused, models=models)


def _ships(number: int) -> Iterator[tuple[Case, SimulatedHull, Truth, dict[str, bytes]]]:
    """Draw ships by a number until one sails her two days and does in a circle what a ship can do."""
    random = stream(_SEED, f"ship {number}")
    effect = EFFECTS[number % len(EFFECTS)]
    while True:
        name, weather = str(random.choice(tuple(HULLS))), str(random.choice(programme.DISTURBANCES))
        strength, seed = int(random.integers(len(SHARES))), int(random.integers(1, 2**31))
        formats = ("mcap", "mcap")
        case = Case(f"ship-{number}", "catalogue", effect, name, 1.0, weather, strength, False, formats, seed)  # noqa: FBT003
        try:
            files, answer = logs_of(case)
            hull = programme.ship(name, seed)
            strengths = theta(case.hidden, next(iter(answer["parameters"].values())), hull)
            if _slides(hull, strengths):
                continue
            truth = truth_of(hull, strengths)
        except (VoyageFailed, DataRejected):
            continue
        if all(isfinite(x) for one in truth.values() for x in one.values()):
            yield case, hull, truth, files


def _slides(hull: SimulatedHull, strengths: Float) -> bool:
    _, state, _ = sailed(hull, strengths, 3.0 * np.pi, max(RUDDERS_DEG), 1)
    v, r, forward = (state[:, plant.STATE.index(x)] for x in ("v", "r", "V"))
    return slides(v, r, forward, hull.length_m)
