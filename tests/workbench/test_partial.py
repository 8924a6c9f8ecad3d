"""A damaged log is taken in as far as it is whole, marked partial, and says what is lost wherever it is shown."""

from pathlib import Path

from tests.ingest.test_salvage import EACH, log
from tests.workbench.driving import kempf

PROFILE = """
sources:
  - match: "*.mcap"
    channels:
      example.heading: {channel: heading, unit: deg}
"""


def test_a_rotten_chunk_and_a_cut_are_reported_at_ingest_and_in_the_list(tmp_path: Path):
    data, places = log()
    damaged = bytearray(data[: places[8][1] + 30])
    damaged[places[3][1] - 20] ^= 1
    path, profile, place = tmp_path / "day.mcap", tmp_path / "profile.yaml", tmp_path / "w"
    path.write_bytes(damaged)
    profile.write_text(PROFILE)
    common = ("--vessel", "aurora", "--profile", profile, "--warehouse", place)
    (output,) = kempf("ingest", path, *common, "--json").json
    assert output["records"] == {"read": 9 * EACH, "kept": 8 * EACH, "rejected": EACH}
    assert output["partial"] is True
    rotten, cut = output["lost"]
    assert rotten["messages"] == EACH and "corruption" in rotten["why"]
    assert rotten["since"] < rotten["until"] < cut["since"] and cut["until"] is None and cut["messages"] is None
    (listed,) = kempf("logs", "list", "--warehouse", place, "--json").json
    assert listed["partial"] is True and listed["lost"] == output["lost"]
    shown = kempf("ingest", path, *common).out
    assert f"partial: 2 stretches of this log could not be read, the first from {rotten['since']} on" in shown
    assert "partial: 2 stretches" in kempf("logs", "list", "--warehouse", place).out
