"""Two people change one vessel's model at once."""

from __future__ import annotations

from pathlib import Path

import pytest

from kempf.flows.jobs.diagnose import add_effect as job
from kempf.schemas.errors import UsageError
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets
from kempf.warehouse.tables.parameter_set import ParameterSet


def test_a_model_that_came_meanwhile_stays(own: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two people add an effect each to the model that both looked at: the second is refused, the first one's stays."""
    warehouse, vessel = Warehouse(str(own)), "mariner"
    plain, first, second, *_ = parameter_sets.summaries(warehouse, vessel)["parameter_set_id"].to_list()
    aliases.point(warehouse, vessel, plain)
    with pytest.raises(UsageError, match="was ps-other when") as caught:
        job.add_effect(warehouse, vessel, "gyro_scale", shown="ps-other")
    assert caught.value.code == "moved_meanwhile"
    # the other one is done while this one is fitted
    made_here = parameter_sets.get(warehouse, second)
    monkeypatch.setattr(job, "choose_refreshed", lambda *_: None)
    monkeypatch.setattr(job, "worsening", lambda _: [])

    def fitted(*_: object) -> ParameterSet:
        aliases.point(warehouse, vessel, first)
        return made_here

    monkeypatch.setattr(job, "stored_model", fitted)
    with pytest.raises(UsageError) as caught:
        job.add_effect(warehouse, vessel, "gyro_scale", shown=plain)
    assert caught.value.code == "moved_meanwhile" and first in str(caught.value)
    assert aliases.of_vessel(warehouse, vessel)[aliases.CURRENT] == first
    # nothing is in the way of one that was looked at
    assert aliases.point(warehouse, vessel, second, expected=first)
    assert not aliases.point(warehouse, vessel, second, expected=first)
