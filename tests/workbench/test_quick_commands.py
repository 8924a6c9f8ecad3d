"""Commands that show what is stored compute nothing: they do not even load what could."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from shutil import copytree

import pytest

from kempf.schemas.model_spec import ModelSpec
from kempf.workbench.cli.entry import COMMANDS
from tests.workbench.driving import one_of
from tests.workbench.test_process import HEAVY, loaded_by

#: what fits, simulates, draws or runs a fleet
ENGINES = {"numba", "prefect", "scipy", "matplotlib", "jinja2"}
EFFECT = "yaw_quadratic"


@pytest.fixture(scope="module")
def modelled(_filled: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A warehouse whose ship stands at a model with an effect; its sets hold the numbers of another."""
    from kempf.flows.jobs.identify.chosen_manoeuvres import choose
    from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN, inputs_of, point
    from kempf.warehouse.storage.store import Warehouse
    from kempf.warehouse.tables import parameter_sets
    from kempf.warehouse.tables.parameter_set import parameter_set_id

    folder = copytree(_filled, tmp_path_factory.mktemp("modelled") / "warehouse")
    warehouse = Warehouse(str(folder))
    like, chosen = parameter_sets.get(warehouse, one_of(folder, "ml")), choose(warehouse, "mariner")
    rms = {"yaw_rate": 0.001, "heading": 0.01, "lateral_speed": None}
    made = []
    for step, spec in enumerate((ModelSpec(), ModelSpec().model_copy(update={"effects": (EFFECT,)}))):
        inputs = inputs_of(chosen, spec, NONE_OF_ONES_OWN)
        rung = {
            "step": step,
            "added": spec.effects[-1] if spec.effects else None,
            "effects": {f"{EFFECT}.c": {"value": 0.1, "std": 0.02, "unit": "1"}} if spec.effects else {},
            "in_sample_error": 0.08,
            "held_out_error": None,
            "disturbance_intensity": {"wind_force_m_s2_per_sqrt_s": 1e-4},
            "log_likelihood": 1000.0 + step,
            "in_sample": {segment.segment_id: rms for segment in chosen.segments},
            "held_out": {},
        }
        made.append(
            replace(
                like,
                parameter_set_id=parameter_set_id(inputs),
                model_name=" + ".join(("plain", *spec.effects)),
                model_spec=inputs.model_spec,
                estimator=inputs.estimator,
                settings=inputs.settings,
                fit={"horizon": "free run", "rung": rung},
                parent=made[-1].parameter_set_id if made else None,
            )
        )
    parameter_sets.insert(warehouse, made)
    point(warehouse, made[-1])
    return folder


OF = ("--vessel", "mariner")


@pytest.mark.parametrize(
    "arguments",
    [("params", "list"), ("history", *OF), ("segments",), ("logs", "list"), ("vessels", "list"), ("ladder", *OF)],
)
def test_what_shows_loads_what_reads_tables_and_nothing_that_computes(modelled: Path, arguments: tuple[str, ...]):
    loaded = loaded_by(*arguments, "--warehouse", modelled)
    assert "deltalake" in loaded
    assert loaded & ENGINES == set()


def test_one_set_is_shown_without_an_engine(modelled: Path):
    assert loaded_by("params", "show", one_of(modelled, "ml"), "--warehouse", modelled) & ENGINES == set()


def test_an_effect_is_undone_and_added_again_from_what_is_stored(modelled: Path):
    assert loaded_by("effects", "undo", *OF, "--warehouse", modelled) & ENGINES == set()
    assert loaded_by("effects", "add", EFFECT, *OF, "--warehouse", modelled) & ENGINES == set()


@pytest.mark.parametrize("arguments", [("list",), ("show", EFFECT), ("show", "--symbols")])
def test_the_catalogue_is_shown_without_a_table(arguments: tuple[str, ...]):
    assert loaded_by("effects", *arguments) & (ENGINES | {"polars", "pyarrow", "deltalake"}) == set()


@pytest.mark.parametrize("name", COMMANDS)
def test_every_help_is_instant(name: str):
    assert loaded_by(name, "--help") & (HEAVY | ENGINES) == set()
