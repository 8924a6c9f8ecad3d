"""A free-running 3 m tanker model on a pond: her zigzags begin almost at rest, and all runs share a stated start."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.default_model import default_model_of
from kempf.flows.jobs.identify.identify_vessel import Request, build, inputs_of
from kempf.flows.jobs.identify.parameter_set_of import SetRequest
from kempf.flows.jobs.ingest.ingest_logs import IngestOutcome, ingest
from kempf.flows.jobs.ingest.log_channels import channels_of
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels
from tests.real_data.voyage import SHARED, require

PROFILE = VesselProfile.model_validate(
    {
        "vessel": "osaka",
        "length_m": 3.0,
        "trial_speed_m_s": 0.4,
        "surroundings": "pond",
        "sources": [
            {
                "match": "*.csv.gz",
                "time": {"column": "t [s]", "unit": "s", "start": "2020-07-31T06:00:00Z"},
                "channels": {
                    "u_velo [m/s]": {"channel": "velocity_forward", "unit": "m/s"},
                    "vm_velo [m/s]": {"channel": "velocity_starboard", "unit": "m/s"},
                    "psi_hat [rad]": {"channel": "heading", "unit": "rad"},
                    "r_angvelo [rad/s]": {"channel": "yaw_rate", "unit": "rad/s"},
                    "delta_rudder [rad]": {"channel": "rudder_angle", "unit": "rad"},
                },
            }
        ],
    }
)


@pytest.fixture(scope="module")
def pond(tmp_path_factory: pytest.TempPathFactory) -> tuple[Warehouse, dict[str, IngestOutcome]]:
    require("data", "esso_osaka")
    paths = sorted(Path(SHARED, "data", "esso_osaka").glob("zigzag_*.csv.gz"))
    warehouse = Warehouse(str(tmp_path_factory.mktemp("pond")))
    return warehouse, {path.name: o for path, o in zip(paths, ingest(warehouse, paths, given=PROFILE), strict=True)}


def test_runs_from_rest_are_read_whole_and_each_is_one_zigzag(
    pond: tuple[Warehouse, dict[str, IngestOutcome]],
) -> None:
    warehouse, outcomes = pond
    found = []
    for name, outcome in outcomes.items():
        assert outcome.tally is not None and outcome.tally.records_rejected == outcome.tally.values_rejected == 0, name
        assert outcome.ingest_id is not None
        speed = channels_of(warehouse, outcome.ingest_id).get("speed_over_ground")
        assert speed is not None and speed.value[0] < 0.1, name
        assert float(np.max(speed.value)) > 0.25, name
        (segment,) = outcome.segments
        assert segment.kind == "zigzag" and segment.psi0_deg == segment.delta0_deg
        found.append(segment.delta0_deg)
    assert sorted(found) == [15.0, 15.0, 20.0, 20.0, 20.0, 30.0]


def test_runs_of_one_stated_start_all_count(pond: tuple[Warehouse, dict[str, IngestOutcome]]) -> None:
    warehouse, outcomes = pond
    chosen = choose(warehouse, "osaka")
    assert len(chosen.segments) == len(outcomes) == 6 and chosen.skipped == {}


def test_a_run_from_rest_is_identified_by_the_model_of_a_pond(
    pond: tuple[Warehouse, dict[str, IngestOutcome]],
) -> None:
    warehouse, outcomes = pond
    (segment,) = outcomes["zigzag_31-Jul-2020_13_42_53.csv.gz"].segments
    spec = default_model_of(warehouse, "osaka")
    assert (spec.name, spec.current) == ("pond", "none")
    profile = vessels.current(warehouse, "osaka")
    request = SetRequest(inputs_of(segment, profile.sha256, Request(spec)), profile, "osaka", (segment.segment_id,), {})
    made = build({segment.log_id: channels_of(warehouse, segment.ingest_id)}, request)
    assert made.convergence["converged"]
    assert 0.15 < made.convergence["speed"]["mean_m_s"] < 0.35
    assert next(p.value for p in made.parameters if p.name == "b2") > 0.0
    # of a stream, or of a speed that nobody knows, there is nothing to say on a pond
    assert not any("trial speed" in w or "opposite heading" in w or "more current" in w for w in made.warnings)
