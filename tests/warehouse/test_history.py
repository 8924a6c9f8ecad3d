from __future__ import annotations

import time
from datetime import UTC, datetime, timedelta, timezone
from typing import Any

import pytest
from deltalake import DeltaTable

from kempf.schemas.errors import NotFound, UsageError
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.queries import history
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets, vessels
from kempf.warehouse.tables.parameter_set import StoredValue
from kempf.warehouse.upkeep import compaction
from tests.warehouse.samples import START_NS, inputs, parameter_set


def put(warehouse: Warehouse, letter: str, start: int, vessel: str = "aurora") -> str:
    return parameter_sets.insert(warehouse, [parameter_set(vessel, inputs(letter * 64, start))])[0]


def after_a_while() -> datetime:
    time.sleep(0.01)
    now = datetime.now(UTC)
    time.sleep(0.01)
    return now


def test_rows_are_in_order_of_start_then_id(warehouse: Warehouse) -> None:
    late = put(warehouse, "a", START_NS + 5)
    early = sorted([put(warehouse, "b", START_NS), put(warehouse, "c", START_NS)])
    put(warehouse, "d", START_NS, vessel="boreas")
    found = history.of_vessel(warehouse, "aurora")
    assert found.frame["parameter_set_id"].to_list() == [name for name in (*early, late) for _ in range(2)]
    assert found.frame["parameter"].to_list() == ["a11", "b2"] * 3
    columns = [
        "parameter_set_id",
        "start_utc_ns",
        "model",
        "estimator",
        "parameter",
        "value",
        "std",
        "unit",
        "superseded",
        "converged",
    ]
    assert found.frame.columns == columns
    assert found.note is None
    row = history.of_vessel(warehouse, "aurora", parameter="b2").rows()[0]
    assert (row["value"], row["std"], row["unit"]) == (1 / 3, None, "1/m^2")
    assert (row["low"], row["high"]) == (None, None)
    row = history.of_vessel(warehouse, "aurora", parameter="a11").rows()[0]
    assert (row["low"], row["high"]) == pytest.approx((-0.1 - 0.0195996, -0.1 + 0.0195996), abs=1e-7)
    assert row["start"] == "2025-05-03T07:47:01.147000001Z"


def test_what_was_known_then(warehouse: Warehouse) -> None:
    vessels.register(warehouse, "aurora", VesselProfile())
    nothing = after_a_while()
    first = put(warehouse, "a", START_NS + 5)
    one = after_a_while()
    put(warehouse, "b", START_NS)
    both = after_a_while()

    def known(then: datetime) -> int:
        return history.of_vessel(warehouse, "aurora", as_of=then).frame["parameter_set_id"].n_unique()

    assert [known(t) for t in (nothing, one, both)] == [0, 1, 2]
    assert set(history.of_vessel(warehouse, "aurora", as_of=one).frame["parameter_set_id"]) == {first}
    assert known(one.astimezone(timezone(timedelta(hours=-9)))) == 1
    before = history.of_vessel(warehouse, "aurora", as_of=nothing)
    assert before.frame.height == 0
    assert before.note is not None
    assert "stored by" in before.note
    assert compaction.compact(warehouse, more_files_than=1) == ("parameter_sets",)
    assert [known(t) for t in (nothing, one, both)] == [0, 1, 2]  # compaction keeps the past


def test_empty_histories_say_why(warehouse: Warehouse) -> None:
    vessels.register(warehouse, "aurora", VesselProfile())
    found = history.of_vessel(warehouse, "aurora")
    assert (found.frame.height, found.rows()) == (0, [])
    assert found.note is not None
    put(warehouse, "a", START_NS, vessel="boreas")
    assert history.of_vessel(warehouse, "aurora").note is not None
    with pytest.raises(NotFound):
        history.of_vessel(warehouse, "nobody")
    with pytest.raises(NotFound):
        history.of_vessel(warehouse, "nobody", as_of=datetime(2001, 1, 1, tzinfo=UTC))


def test_wrong_questions_are_answered_with_the_right_ones(warehouse: Warehouse) -> None:
    put(warehouse, "a", START_NS)
    with pytest.raises(UsageError) as caught:
        history.of_vessel(warehouse, "aurora", parameter="b3")
    assert "a11, b2" in caught.value.message
    with pytest.raises(UsageError) as caught:
        history.of_vessel(warehouse, "aurora", as_of=datetime(2025, 5, 3))  # noqa: DTZ001 - the point of the test
    assert caught.value.code == "as_of_without_zone"


def test_clocks_that_disagree_do_not_reorder_versions(warehouse: Warehouse, monkeypatch: pytest.MonkeyPatch) -> None:
    for letter in "abc":  # and the commit that made the table
        put(warehouse, letter, START_NS)
    stamps = [(0, 1000), (1, 5000), (2, 3000), (3, 6000)]
    entries = [{"version": v, "timestamp": t} for v, t in reversed(stamps)]
    monkeypatch.setattr(DeltaTable, "history", lambda self, limit=None: entries)

    def at(ms: int) -> int | None:
        return delta.version_as_of(warehouse, "parameter_sets", datetime.fromtimestamp(ms / 1000, UTC))

    assert [at(ms) for ms in (999, 1000, 3500, 5000, 6000)] == [None, 0, 0, 2, 3]
    assert delta.version_as_of(warehouse, "runs", datetime.now(UTC)) is None


def test_one_parameter_is_found_among_a_hundred_thousand_rows(warehouse: Warehouse) -> None:
    estimates = tuple(StoredValue(f"p{i}", float(i), 0.1, "1") for i in range(50))
    sets = [
        parameter_set(f"v{i % 4}", inputs(settings={"i": i}), parameters=estimates, parameter_set_id=f"ps-{i:016x}")
        for i in range(2000)
    ]
    parameter_sets.insert(warehouse, sets)
    found = history.of_vessel(warehouse, "v1", parameter="p7")
    assert found.frame.height == 500


def test_a_commit_of_that_very_moment_does_not_shift_the_others(warehouse: Warehouse, monkeypatch: Any) -> None:
    """Commits are listed after the table was opened: one that came meanwhile must not push the others down by one."""
    moments = []
    for i, letter in enumerate("abc"):
        put(warehouse, letter, START_NS + i)
        moments.append(after_a_while())
    listed, late = DeltaTable.history, ["d", "e"]

    def while_another_writes(table: DeltaTable, limit: int | None = None) -> list[dict[str, Any]]:
        if late and table.table_uri.rstrip("/").endswith("parameter_sets"):
            put(Warehouse(warehouse.uri), late.pop(), START_NS + 9)
        return listed(table, limit)

    monkeypatch.setattr(DeltaTable, "history", while_another_writes)
    for _ in range(2):  # what was listed is kept with the table
        known = [history.of_vessel(warehouse, "aurora", as_of=m).frame["parameter_set_id"].n_unique() for m in moments]
        assert known == [1, 2, 3]
    assert history.of_vessel(warehouse, "aurora", as_of=after_a_while()).frame["parameter_set_id"].n_unique() == 5
