"""Values that no ship has, and those of a ship of another size or speed than the profile says."""

from __future__ import annotations

import gzip
from dataclasses import replace

import numpy as np
import polars as pl
import pytest

from kempf.flows.jobs.ingest.examine_log import examine_instruments
from kempf.pipeline.channels.doctor.examine import Examination, examine
from kempf.pipeline.channels.doctor.log import Log
from kempf.pipeline.channels.doctor.outcome import Outcome
from kempf.pipeline.channels.doctor.refused import by_channel, count
from kempf.pipeline.channels.doctor.verdict import sentence
from kempf.pipeline.channels.instruments import from_readings
from kempf.pipeline.channels.series import Series
from kempf.pipeline.simulate.csv_log import to_csv
from kempf.pipeline.simulate.logger_profile import logger_profile
from kempf.pipeline.simulate.trial import simulate_trial, zigzag_settings
from tests.doctor import closed_form_ship
from tests.reading import read_log

#: That the closed-form ship makes.
SPEED_M_S = 6.0


def log(**changed: float) -> Log:
    return replace(closed_form_ship.log(), trial_speed_m_s=SPEED_M_S, **changed)


def times(one: Log, factor: float, *names: str) -> Log:
    return one.with_series({n: Series(one.series[n].time_utc_ns, one.series[n].value * factor) for n in names})


def said(found: Examination) -> list[str]:
    return [sentence(finding) for finding in found.findings]


def size(found: Examination) -> Outcome:
    return next(o for o in found.outcomes if o.check == "size_and_speed")


def test_a_ship_of_her_size_is_clean() -> None:
    found = examine(log())
    assert found.findings == ()
    assert size(found).state == "agree"


@pytest.mark.parametrize(("factor", "expected"), [(0.1, "too small"), (10.0, "too large")])
def test_a_length_ten_times_off_is_said_to_be(factor: float, expected: str) -> None:
    found = examine(log(length_m=factor * closed_form_ship.LENGTH_M))
    (words,) = said(found)
    assert "length_m of the profile" in words
    assert expected in words
    assert "trial_speed" not in words


def test_speeds_that_are_no_ships_of_that_trial_speed() -> None:
    names = ("speed_over_ground", "speed_through_water")
    # without fixes nothing but the trial speed says that both are in km/h
    fast = times(log().with_series({"latitude": None, "longitude": None}), 3.6, *names)
    (words,) = said(examine(fast))
    assert "speed" in words
    outcome = size(examine(fast))
    assert outcome.figures[0].value == pytest.approx(3.6, rel=0.15)
    assert outcome.state == "disagree"


def test_one_speed_in_km_h_gets_its_line() -> None:
    one = replace(log(), units={"speed_through_water": "m/s"})
    (finding,) = examine(times(one, 3.6, "speed_through_water")).findings
    assert [f.name for f in finding.faults] == ["km/h taken for m/s"]
    assert {"size_and_speed"} <= {o.check for o in finding.evidence}


def test_a_trial_speed_that_is_not_hers() -> None:
    (words,) = said(examine(replace(log(), trial_speed_m_s=1.5)))
    assert words.startswith("trial_speed_m_s of the profile")


def test_plausible_values_alone_make_no_log_clean() -> None:
    bare = Log({"speed_over_ground": closed_form_ship.log().series["speed_over_ground"]})
    found = examine(bare)
    assert (found.verdict, found.untested) == ("untested", ("speed_over_ground",))


@pytest.mark.parametrize(
    ("name", "value"),
    [("speed_over_ground", 50.0), ("yaw_rate", 1.9), ("rudder_angle", 1.5), ("velocity_north", -45.0)],
)
def test_readings_that_no_ship_has(name: str, value: float) -> None:
    random = np.random.Generator(np.random.PCG64(1))
    own = Series(closed_form_ship.time_ns(), value + 0.01 * random.standard_normal(closed_form_ship.time_ns().size))
    found = examine(Log({name: own}))
    assert found.verdict == "faults"
    assert said(found) == [f"{name} has values that no ship has"]


def test_what_ingest_refused_is_counted_and_no_clean_log() -> None:
    settings = zigzag_settings("ferry", duration_s=400.0, seed=5)
    text = gzip.decompress(to_csv(simulate_trial(settings))).decode().splitlines()
    head = text[0].split(",")
    spoilt = [text[0]]
    for k, line in enumerate(text[1:]):
        cells = line.split(",")
        if k % 4 == 0:
            cells[head.index("rot")] = "11588"
        spoilt.append(",".join(cells))
    profile = logger_profile(settings)
    read = read_log("trial.csv", "\n".join(spoilt).encode(), profile)
    refused = count(read.rejections())
    assert refused["row", "yaw_rate"] == len(text[1:][::4])
    found = examine_instruments(from_readings(read.frame), profile, "trial.csv", "delimited", refused)
    assert found.content["verdict"] == "faults"
    (finding,) = found.content["findings"]
    assert finding["words"] == "yaw_rate has values that no ship has"
    assert "outside its range (-114.6 deg/s to 114.6 deg/s)" in finding["evidence"][0]["words"]


def test_a_record_that_was_refused_whole_counts_for_the_channels_of_its_source() -> None:
    table = pl.DataFrame(
        {
            "record": [1, 2, 3, 4],
            "time_utc_ns": [1, 2, 3, 4],
            "source": ["/mru/roll", "/gnss", "/gnss", "/lost"],
            "channel": [None, "speed_over_ground", None, None],
            "reason": ["out_of_range", "out_of_range", "duplicate", "out_of_range"],
            "raw": [""] * 4,
        },
        schema_overrides={"channel": pl.String},
    )
    refused = count([table, table])
    sources = {"roll": "/mru/roll", "speed_over_ground": "/gnss", "course_over_ground": "/gnss"}
    assert by_channel(refused, sources) == {"roll": 2, "speed_over_ground": 2, "/lost": 2}
