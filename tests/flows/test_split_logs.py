"""Parts of one recording that are taken in together: a hint says that they are, and what to do."""

from __future__ import annotations

from pathlib import Path

from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from tests.ingest.test_mcap import CHANNELS, plain, write

PROFILE = VesselProfile.model_validate({"vessel": "launch", "sources": [{"match": "*.mcap", "channels": CHANNELS}]})


def test_parts_of_a_recording_are_named_at_the_first_of_them(tmp_path: Path) -> None:
    messages = plain(60)
    apart = [(topic, seconds + 100.0, message) for topic, seconds, message in messages]
    parts = {"bag_0.mcap": messages[:60], "bag_1.mcap": messages[60:], "alone.mcap": apart}
    for name, own in parts.items():
        (tmp_path / name).write_bytes(write(own))
    paths = [tmp_path / name for name in ("bag_1.mcap", "alone.mcap", "bag_0.mcap")]
    outcomes = ingest(Warehouse(str(tmp_path / "w")), paths, None, PROFILE)
    hints = [[note for note in one.notes if "parts of one recording" in note] for one in outcomes]
    assert [len(own) for own in hints] == [0, 0, 1]
    assert "bag_0.mcap and bag_1.mcap follow each other" in hints[2][0]
    assert "`cat bag_0.mcap bag_1.mcap > whole.mcap`" in hints[2][0]
    (tmp_path / "whole.mcap").write_bytes(b"".join((tmp_path / f"bag_{k}.mcap").read_bytes() for k in (0, 1)))
    (whole,) = ingest(Warehouse(str(tmp_path / "w")), [tmp_path / "whole.mcap"], None, PROFILE)
    assert whole.tally is not None and whole.tally.records_kept == 120
