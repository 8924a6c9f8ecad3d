"""Which instrument serves a channel, and the forms its values take."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import polars as pl
import pytest
import yaml

from kempf.pipeline.channels import instruments
from kempf.pipeline.channels.instruments import from_readings
from kempf.pipeline.ingest.readings import READING_SCHEMA
from kempf.schemas.profile import parse
from tests.reading import read_log

ROOT = Path(__file__).parents[2]
START = 1_746_252_000_000_000_000
SECOND = 1_000_000_000


def frame(*blocks: tuple[str, np.ndarray, dict[str, np.ndarray]]) -> pl.DataFrame:
    """Readings of several sources: (source, seconds, values by column)."""
    parts = [
        pl.DataFrame(
            {"time_utc_ns": START + np.round(t * SECOND).astype(np.int64), "source": [source] * t.size, **values}
        )
        for source, t, values in blocks
    ]
    rows = pl.concat(parts, how="diagonal").with_row_index("record").with_columns(pl.col("record").cast(pl.Int64))
    missing = [pl.lit(None, dtype=kind).alias(n) for n, kind in READING_SCHEMA.items() if n not in rows.columns]
    return rows.with_columns(missing).select(*READING_SCHEMA)


def gnss(t: np.ndarray, seed: int = 0) -> dict[str, np.ndarray]:
    random = np.random.default_rng(seed)
    return {
        "speed_over_ground_m_s": 7.0 + 0.1 * random.standard_normal(t.size),
        "course_over_ground_rad": np.mod(0.01 * random.standard_normal(t.size), 2 * np.pi),
    }


def test_what_is_not_known_of_the_instants_of_the_source_that_serves_is_kept() -> None:
    t = np.arange(0.0, 100.0, 0.5)
    coarse = frame(("HEHDT", t, {"heading_rad": 0.1 * np.sin(t / 9.0)}), ("GPRMC", t[::2], gnss(t[::2]))).with_columns(
        pl.when(pl.col("source") == "HEHDT").then(0.14).alias("instant_std_s")
    )
    assert from_readings(coarse).instant_std_s == {"heading": 0.14}
    # another source, less frequent, serves nothing
    both = pl.concat([coarse, frame(("HCHDG", t[::3], {"heading_rad": 0.1 * np.sin(t[::3] / 9.0)}))])
    assert from_readings(both).sources["heading"] == "HEHDT" and from_readings(both).instant_std_s == {"heading": 0.14}
    exact = coarse.with_columns(pl.lit(None, dtype=pl.Float64).alias("instant_std_s"))
    assert from_readings(exact).instant_std_s == {}


def test_the_source_with_most_readings_serves_the_channel() -> None:
    fast, slow = np.arange(0.0, 100.0, 0.2), np.arange(0.0, 100.0, 1.0)
    found = from_readings(
        frame(("HCHDG", slow, {"heading_rad": 0.1 + 0.0 * slow}), ("HEHDT", fast, {"heading_rad": 0.2 + 0.001 * fast}))
    )
    assert found.sources["heading"] == "HEHDT"
    assert len(found.series["heading"]) == fast.size
    assert found.notes[-1] == (
        "heading from HEHDT; also in HCHDG (-8.6 deg in the median, 95 % within 2.7 deg of that), not used"
    )


def test_a_second_instrument_is_compared_with_the_one_that_serves_the_channel() -> None:
    t = np.arange(0.0, 100.0, 0.5)
    # headings on either side of north, and a speed log of another scale
    heading = np.mod(0.1 * np.sin(t / 10.0), 2 * np.pi)
    other = np.mod(heading + np.deg2rad(3.0), 2 * np.pi)
    first = gnss(t) | {"heading_rad": heading}
    second = {name: first[name][::2] for name in gnss(t)} | {"heading_rad": other[::2]}
    second["speed_over_ground_m_s"] = second["speed_over_ground_m_s"] + 0.5
    few = {"heading_rad": other[:5]}
    found = from_readings(frame(("bow", t, first), ("mast", t[::2], second), ("spare", t[:5], few)))
    notes = [note for note in found.notes if "not used" in note]
    assert notes == [
        "speed_over_ground and course_over_ground from bow; also in mast (speed_over_ground +0.5 m/s in the median, "
        "95 % within 0 m/s of that; course_over_ground alike), not used",
        "heading from bow; also in mast (+3 deg in the median, 95 % within 0 deg of that), spare, not used",
    ]


@pytest.mark.parametrize("behind", ["HCHDG", "IIHDT"])
def test_a_compass_that_deviates_and_a_repeater_come_after_the_gyro_however_fast_they_are(behind: str) -> None:
    slow, fast = np.arange(0.0, 100.0, 0.2), np.arange(0.0, 100.0, 0.1)
    found = from_readings(
        frame(("HEHDT", slow, {"heading_rad": 0.1 + 0.001 * slow}), (behind, fast, {"heading_rad": 0.1 + 0.001 * fast}))
    )
    assert found.sources["heading"] == "HEHDT"
    # a gyro that was on for a tenth of the log serves none
    few = slow[: slow.size // 10]
    found = from_readings(
        frame(("HEHDT", few, {"heading_rad": 0.1 + 0.001 * few}), (behind, fast, {"heading_rad": 0.1 + 0.001 * fast}))
    )
    assert found.sources["heading"] == behind


def test_topics_that_are_about_as_frequent_are_taken_by_name() -> None:
    t = np.arange(0.0, 100.0, 0.1)
    lossy = t[np.arange(t.size) % 20 != 7]
    found = from_readings(
        frame(("/gyro1/heading", lossy, {"heading_rad": 0.0 * lossy}), ("/gyro2/heading", t, {"heading_rad": 0.0 * t}))
    )
    assert found.sources["heading"] == "/gyro1/heading"


def test_rmc_comes_before_vtg_where_both_are_equally_fast() -> None:
    t = np.arange(0.0, 200.0)
    # one RMC in a hundred was damaged
    whole = np.arange(t.size) % 100 != 7
    rmc = {name: value[whole] for name, value in gnss(t).items()}
    found = from_readings(frame(("GPRMC", t[whole], rmc), ("GPVTG", t + 0.02, gnss(t))))
    assert found.sources["course_over_ground"] == found.sources["speed_over_ground"] == "GPRMC"
    assert len(found.series["speed_over_ground"]) == np.count_nonzero(whole)


def test_a_much_faster_vtg_comes_before_rmc() -> None:
    slow, fast = np.arange(0.0, 100.0), np.arange(0.0, 100.0, 0.2)
    found = from_readings(frame(("GPRMC", slow, gnss(slow)), ("GPVTG", fast, gnss(fast))))
    assert found.sources["course_over_ground"] == "GPVTG"
    # messages have stamps of their own
    assert found.row_s == 0.0


def rows(row_s: float, held_rows: int = 1) -> pl.DataFrame:
    """A table of 400 rows in which a heading is fresh in every row, and a yaw rate held for some."""
    t = row_s * np.arange(400.0)
    random = np.random.default_rng(7)
    measured = np.arange(400 // held_rows + 1)
    yaw_rate = 0.01 * np.sin(0.02 * measured) + 1e-5 * random.standard_normal(measured.size)
    heading = 1.0 + 0.2 * np.sin(0.05 * t) + 1e-5 * random.standard_normal(t.size)
    values = {"heading_rad": heading, "yaw_rate_rad_s": np.repeat(yaw_rate, held_rows)[: t.size]}
    return frame(("row", t, values))


def test_who_repeats_one_instrument_samples_the_others_too() -> None:
    found = from_readings(rows(0.2, held_rows=5))
    heading = found.series["heading"]
    assert len(heading) == 400 and len(found.series["yaw_rate"]) == 80
    # anywhere in the row before
    assert heading.time_utc_ns[0] == START - 100_000_000 and heading.period_s == pytest.approx(0.2)
    assert found.instant_std_s["heading"] == pytest.approx(0.2 / 12.0**0.5)
    assert any(note.startswith("heading: in rows of 0.2 s, that repeat other instruments: ") for note in found.notes)
    assert 0.0 < found.instant_std_s["yaw_rate"] <= 0.2 / 12.0**0.5 * 1.001


def test_rows_as_slow_as_instruments_do_not_show_that_they_repeat_any() -> None:
    found = from_readings(rows(1.0))
    assert found.series["heading"].time_utc_ns[0] == found.series["yaw_rate"].time_utc_ns[0] == START - SECOND // 2
    assert found.instant_std_s == pytest.approx(dict.fromkeys(("heading", "yaw_rate"), 12.0**-0.5))
    assert any(note.startswith("heading and yaw_rate: in rows of 1 s, as slow as instru") for note in found.notes)


def test_fast_rows_that_repeat_nothing_are_the_instants_of_measurement() -> None:
    found = from_readings(rows(0.2))
    assert found.series["heading"].time_utc_ns[0] == START and not found.instant_std_s
    assert found.row_s == pytest.approx(0.2)


def test_a_column_that_is_seldom_filled_makes_no_slow_rows_of_fast_ones() -> None:
    table = rows(0.2).with_columns(
        pl.when(pl.col("record") % 10 == 0).then(pl.col("yaw_rate_rad_s")).alias("yaw_rate_rad_s")
    )
    found = from_readings(table)
    assert found.series["yaw_rate"].period_s == pytest.approx(2.0) and not found.instant_std_s


def test_a_table_of_one_row_has_no_rows_apart() -> None:
    found = from_readings(rows(1.0).head(1))
    assert found.series["heading"].time_utc_ns.tolist() == [START] and not found.instant_std_s
    assert found.row_s == 0.0


def test_rows_that_hold_one_reading_each_have_its_instant() -> None:
    """Readings of 1 Hz that are written as they come are no rows of 1 s."""
    table = pl.concat(
        [
            rows(1.0)
            .select(*READING_SCHEMA)
            .with_columns(
                pl.col("time_utc_ns") + round(late_s * SECOND),
                *(
                    pl.lit(None, dtype=pl.Float64).alias(other)
                    for other in ("heading_rad", "yaw_rate_rad_s")
                    if other != own
                ),
            )
            for own, late_s in (("heading_rad", 0.13), ("yaw_rate_rad_s", 0.57))
        ]
    ).sort("time_utc_ns")
    found = from_readings(table)
    assert found.series["heading"].time_utc_ns[0] == START + round(0.13 * SECOND)
    assert found.series["yaw_rate"].period_s == 1.0 and not found.instant_std_s


def test_rows_that_share_a_coarse_time_are_not_as_slow_as_that() -> None:
    table = rows(0.2).with_columns(pl.col("time_utc_ns") // SECOND * SECOND)
    assert not from_readings(table).instant_std_s


@pytest.mark.parametrize("held_rows", [1, 5])
def test_messages_have_instants_of_their_own_however_slow_they_are(held_rows: int) -> None:
    found = from_readings(rows(1.0, held_rows).with_columns(source=pl.lit("HEHDT")))
    assert found.series["heading"].time_utc_ns[0] == START and "heading" not in found.instant_std_s


def test_a_long_log_is_asked_column_by_column_and_says_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    slow, fast = np.arange(0.0, 100.0), np.arange(0.0, 100.0, 0.2)
    rows = frame(("GPRMC", slow, gnss(slow)), ("GPVTG", fast, gnss(fast)), ("HEHDT", fast, {"heading_rad": 0.1 * fast}))
    heights: list[int] = []
    collect = pl.LazyFrame.collect

    def stated(frame: pl.LazyFrame) -> pl.DataFrame:
        found = collect(frame)
        heights.append(found.height)
        return found

    monkeypatch.setattr(pl.LazyFrame, "collect", stated)
    short = from_readings(rows.lazy())
    assert rows.height in heights
    heights.clear()
    monkeypatch.setattr(instruments, "_SHORT", rows.height - 1)
    long = from_readings(rows.lazy())
    assert heights and rows.height not in heights
    assert (long.sources, long.notes, set(long.series)) == (short.sources, short.notes, set(short.series))
    for name, one in long.series.items():
        np.testing.assert_array_equal(one.time_utc_ns, short.series[name].time_utc_ns)
        np.testing.assert_array_equal(one.value, short.series[name].value)


def test_angles_are_unwrapped_across_north_both_ways() -> None:
    t = np.arange(0.0, 400.0)
    true = 0.5 * np.sin(0.02 * t) + 0.003 * t - 0.6
    found = from_readings(frame(("HEHDT", t, {"heading_rad": true % (2 * np.pi)}))).series["heading"]
    assert np.max(np.abs(np.diff(found.value))) < 0.1
    np.testing.assert_allclose(found.value - found.value[0], true - true[0], atol=1e-12)


def test_values_that_do_not_wrap_are_not_unwrapped() -> None:
    t = np.arange(0.0, 100.0)
    jumpy = np.where(np.arange(t.size) % 2 == 0, 4.0, -4.0) + 0.001 * t
    found = from_readings(frame(("log", t, {"speed_through_water_m_s": jumpy})))
    np.testing.assert_array_equal(found.series["speed_through_water"].value, jumpy)


def test_speed_and_course_come_from_velocities_where_there_is_nothing_else() -> None:
    t = np.arange(0.0, 100.0, 0.5)
    course = 3.0 + 0.01 * t  # through south, where arctan2 jumps
    north, east = 5.0 * np.cos(course), 5.0 * np.sin(course)
    found = from_readings(frame(("row", t, {"velocity_north_m_s": north, "velocity_east_m_s": east})))
    np.testing.assert_allclose(found.series["speed_over_ground"].value, 5.0)
    np.testing.assert_allclose(np.diff(found.series["course_over_ground"].value), 0.005, atol=1e-12)
    assert found.sources["course_over_ground"] == "row"
    assert any("earth-fixed" in note for note in found.notes)


def test_a_course_of_its_own_is_not_replaced_by_velocities() -> None:
    t = np.arange(0.0, 100.0)
    values = gnss(t) | {"velocity_north_m_s": 1.0 + 0.01 * t, "velocity_east_m_s": 2.0 - 0.01 * t}
    found = from_readings(frame(("row", t, values)))
    np.testing.assert_array_equal(found.series["speed_over_ground"].value, values["speed_over_ground_m_s"])


def test_speed_and_course_in_separate_messages_are_both_found() -> None:
    t = np.arange(0.0, 100.0)
    values = gnss(t)
    speed = {"speed_over_ground_m_s": values["speed_over_ground_m_s"]}
    course = {"course_over_ground_rad": values["course_over_ground_rad"]}
    found = from_readings(frame(("/gnss/sog", t, speed), ("/gnss/cog", t + 0.01, course)))
    assert found.sources["speed_over_ground"] == "/gnss/sog"
    assert found.sources["course_over_ground"] == "/gnss/cog"


def test_messages_out_of_order_and_repeated_instants_become_a_series() -> None:
    t = np.array([0.0, 2.0, 1.0, 1.0, 3.0])
    found = from_readings(frame(("ROT", t, {"yaw_rate_rad_s": np.array([0.0, 0.2, 0.1, 0.9, 0.3])})))
    assert found.series["yaw_rate"].value.tolist() == [0.0, 0.1, 0.2, 0.3]


def test_a_channel_the_log_lacks_is_absent() -> None:
    found = from_readings(frame(("HEHDT", np.arange(50.0), {"heading_rad": 0.01 * np.arange(50.0)})))
    assert found.get("rudder_angle") is None
    assert set(found.series) == {"heading"}


def test_the_towing_tank_gives_speed_and_course_from_its_velocities() -> None:
    path = ROOT.parent / "shared" / "data" / "kvlcc2_hsva" / "HSVA_CPMC_KVLCC2_Z_20_10_P.dat"
    if not path.exists():
        pytest.skip(f"{path.parent} is absent: the towing tank data are not part of the project")
    text = (ROOT / "docs" / "profiles" / "hsva_kvlcc2.yaml").read_text(encoding="utf-8")
    readings = read_log(path.name, path.read_bytes(), parse(yaml.safe_load(text), "hsva_kvlcc2.yaml"))
    found = from_readings(readings.frame)
    speed = found.series["speed_over_ground"]
    assert speed.value[0] == pytest.approx(1.179, abs=0.01)
    assert 0.8 < np.median(speed.value) < 1.0  # the zigzag costs a quarter of it
    drift = found.series["course_over_ground"].at(speed.time_utc_ns, 1.0) - found.series["heading"].at(
        speed.time_utc_ns, 1.0
    )
    drift = np.arctan2(np.sin(drift), np.cos(drift))
    assert np.nanmax(np.abs(drift[200:])) < np.deg2rad(30.0)
    assert found.series["rudder_angle"].period_s == pytest.approx(0.05)


def test_readings_in_files_out_of_order_give_the_same_series(tmp_path: Path) -> None:
    random = np.random.default_rng(5)
    t = np.arange(0.0, 300.0, 0.5)
    t[[40, 41, 200]] = t[[41, 40, 199]]  # two exchanged, one instant twice: the first reading counts
    rows = frame(("HEHDT", t, {"heading_rad": random.uniform(1.0, 1.2, t.size)}), ("GPRMC", t, gnss(t)))
    rows = rows.sort("time_utc_ns", maintain_order=True).with_columns(record=pl.int_range(rows.height))
    rows = pl.concat([rows[500:], rows[:500]])
    for k, part in enumerate(rows.iter_slices(97)):
        part.write_parquet(tmp_path / f"{k:03d}.parquet")
    held, lazy = from_readings(rows), from_readings(pl.scan_parquet(sorted(tmp_path.glob("*.parquet"))))
    order = np.argsort(rows["time_utc_ns"].to_numpy(), kind="stable")
    own = (
        rows[order].filter(pl.col("heading_rad").is_not_null()).unique("time_utc_ns", keep="first", maintain_order=True)
    )
    for found in (held, lazy):
        heading = found.series["heading"]
        assert np.array_equal(heading.time_utc_ns, own["time_utc_ns"].to_numpy())
        assert np.array_equal(heading.value, own["heading_rad"].to_numpy())
    assert held.sources == lazy.sources and held.notes == lazy.notes
