from __future__ import annotations

import json
from dataclasses import asdict
from dataclasses import replace as changed

import pytest

from kempf.schemas.errors import NotFound
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.canonical import canonical_json
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import segments
from kempf.warehouse.tables.deposit import deposit
from kempf.warehouse.tables.segments import Segment
from tests.warehouse.samples import START_NS, delivery, segment


def as_text(one: Segment) -> str:
    return canonical_json(asdict(one), name_non_finite=True)


def test_finding_again_replaces(warehouse: Warehouse) -> None:
    one, two = deposit(warehouse, [delivery(data=b"1"), delivery(data=b"2")])
    late = segment("aurora", one.log_id, one.ingest_id, START_NS + 10)
    early = segment("aurora", one.log_id, one.ingest_id)
    other = segment("aurora", two.log_id, two.ingest_id, START_NS + 5)
    found = {one.ingest_id: [late, early], two.ingest_id: [other]}
    assert segments.replace(warehouse, {("aurora", ingest): rows for ingest, rows in found.items()}) == tuple(
        sorted(found)
    )
    assert [s.segment_id for s in segments.current(warehouse, "aurora")] == [s.segment_id for s in (early, other, late)]
    version = delta.versions(warehouse)
    assert segments.replace(warehouse, {("aurora", one.ingest_id): [early, late]}) == ()
    assert delta.versions(warehouse) == version

    better = changed(early, overshoots_deg=(9.8,))
    assert segments.replace(warehouse, {("aurora", one.ingest_id): [better]}) == (one.ingest_id,)
    assert segments.get(warehouse, early.segment_id).overshoots_deg == (9.8,)
    assert len(segments.current(warehouse)) == 2
    assert segments.replace(warehouse, {("aurora", one.ingest_id): []}) == (one.ingest_id,)
    assert [s.segment_id for s in segments.current(warehouse)] == [other.segment_id]
    assert segments.replace(warehouse, {}) == ()


def test_a_segment_comes_back_as_it_was_and_shows_itself(warehouse: Warehouse) -> None:
    (one,) = deposit(warehouse, [delivery()])
    given = segment("aurora", one.log_id, one.ingest_id)
    segments.replace(warehouse, {("aurora", one.ingest_id): [given]})
    stored = segments.get(warehouse, given.segment_id)
    assert as_text(stored) == as_text(given)
    shown = stored.as_json("day1.nmea.gz")
    assert shown["start"] == "2025-05-03T07:47:01.147000001Z"
    assert shown["log"] == "day1.nmea.gz"
    assert shown["overshoots_deg"] == [9.7, None]
    assert shown["quality"] == {"gap_s": None}
    json.dumps(shown, allow_nan=False)


def test_only_the_current_ingest_counts(warehouse: Warehouse) -> None:
    (first,) = deposit(warehouse, [delivery()])
    segments.replace(warehouse, {("aurora", first.ingest_id): [segment("aurora", first.log_id, first.ingest_id)]})
    (second,) = deposit(warehouse, [delivery(length_m=60.0)])
    assert segments.current(warehouse, "aurora") == []
    again = segment("aurora", second.log_id, second.ingest_id)
    segments.replace(warehouse, {("aurora", second.ingest_id): [again]})
    assert [s.ingest_id for s in segments.current(warehouse, "aurora")] == [second.ingest_id]


def test_wrong_ones_are_refused(warehouse: Warehouse) -> None:
    (one,) = deposit(warehouse, [delivery()])
    with pytest.raises(ValueError, match="boreas"):
        segments.replace(warehouse, {("aurora", one.ingest_id): [segment("boreas", one.log_id, one.ingest_id)]})
    for read, name in ((segments.get, "seg-x"), (segments.current, "boreas")):
        with pytest.raises(NotFound):
            read(warehouse, name)
