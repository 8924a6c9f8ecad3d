"""Clocks of an NMEA log: that of a logger that is off, stamps that are coarse, and two receivers that disagree."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np
import polars as pl
import pytest

from tests.ingest.test_nmea_clock import START, read, rmc, sentence

RATE_HZ = 5


def instants(many: int) -> list[datetime]:
    return [START + timedelta(seconds=k) for k in range(many)]


def log(many: int = 120, lead=lambda second: 0.0, stamp=lambda when: f"{when:%Y-%m-%dT%H:%M:%S.%f}Z") -> list[str]:
    """A fix a second that arrives after 20 ms, and headings five times a second, 30 ms into each fifth."""
    arrived = [(k + 0.02, rmc(when)) for k, when in enumerate(instants(many))]
    arrived += [(k + n / RATE_HZ + 0.03, sentence(f"HEHDT,{k}.{n},T")) for k in range(many) for n in range(RATE_HZ)]
    return [f"{stamp(START + timedelta(seconds=second + lead(second)))} {words}" for second, words in sorted(arrived)]


def late(readings) -> np.ndarray:
    """How long after it was measured each heading is dated, s, in the order of the log."""
    headings = readings.frame.filter(readings.frame["heading_rad"].is_not_null())
    value = np.round(np.rad2deg(headings["heading_rad"].to_numpy()), 1)
    measured = np.floor(value) + (value % 1.0) * 10.0 / RATE_HZ
    return (headings["time_utc_ns"].to_numpy() - int(START.timestamp()) * 10**9) / 1e9 - measured


@pytest.mark.parametrize("lead_s", [3.7, -2.0, 7200.0, -315_360_000.0])
def test_a_logger_s_clock_that_is_off_is_put_right_by_the_receiver(lead_s: float) -> None:
    readings = read(*log(lead=lambda _: lead_s))
    np.testing.assert_allclose(late(readings), 0.01, atol=2e-3)
    (note,) = readings.notes
    assert ("ahead of" if lead_s > 0 else "behind") in note and "stamps were put right by it" in note
    assert readings.tally.records_rejected == 0


def test_a_receiver_that_sends_late_is_no_clock_that_is_off() -> None:
    readings = read(*log(lead=lambda _: 0.4))
    np.testing.assert_allclose(late(readings), 0.43, atol=2e-3)
    assert readings.notes == ()
    # it may be either
    readings = read(*log(lead=lambda _: 0.8))
    np.testing.assert_allclose(late(readings), 0.83, atol=2e-3)
    (note,) = readings.notes
    assert "0.820 s ahead of" in note and "They were kept" in note


def test_a_clock_that_is_set_or_drifts_is_followed() -> None:
    readings = read(*log(lead=lambda second: 3.0 if second < 60.6 else 0.0))
    np.testing.assert_allclose(late(readings), 0.01, atol=2e-3)
    assert "from 0.020 to 3.020 s" in readings.notes[0]
    readings = read(*log(300, lead=lambda second: 0.01 * second))
    assert np.abs(late(readings)).max() < 0.2  # the ends of a median of half a minute


def test_what_a_receiver_takes_to_send_turns_no_time_back() -> None:
    waits = np.random.default_rng(4).uniform(0.0, 0.4, 400)
    # a compass fifty times a second, and fixes that wait now and then
    lines = [(k + waits[k], rmc(when)) for k, when in enumerate(instants(400))]
    lines += [(k / 50.0, sentence(f"HEHDT,{k % 3600 / 10.0:.1f},T")) for k in range(50 * 400)]
    at = [f"{START + timedelta(seconds=second + 5.0):%Y-%m-%dT%H:%M:%S.%f}Z {words}" for second, words in sorted(lines)]
    readings = read(*at)
    assert readings.tally.records_rejected == 0
    headings = readings.frame.filter(readings.frame["heading_rad"].is_not_null())["time_utc_ns"].to_numpy()
    off = (headings - int(START.timestamp()) * 10**9) / 1e9 - np.arange(headings.size) / 50.0
    # the receiver's own delay stays, 0.2 s in the middle
    assert np.abs(off + 0.2).max() < 0.1


def unsure_s(readings) -> list[float | None]:
    """The standard errors of the instants of headings, s; fixes have their own."""
    fixes, headings = (readings.frame.filter(pl.col("source") == source) for source in ("GPRMC", "HEHDT"))
    assert fixes.height and fixes["instant_std_s"].is_null().all()
    return headings["instant_std_s"].unique().to_list()


def test_stamps_of_whole_seconds_are_spread_over_the_second() -> None:
    readings = read(*log(stamp=lambda when: f"{when:%Y-%m-%dT%H:%M:%S}Z"))
    assert readings.tally.records_rejected == 0 and "whole seconds" in readings.notes[0]
    # each in the middle of its fifth of a second, in which it may have been measured at any time
    np.testing.assert_allclose(late(readings), 0.1, atol=1e-6)
    assert unsure_s(readings) == [pytest.approx(0.2 / 12.0**0.5)]


@pytest.mark.parametrize(("looks_s", "sends_s"), [(0.2, 0.1), (0.05, 0.02), (0.63, 0.7)])
def test_bursts_hide_how_late_a_receiver_sends_and_move_no_clock(looks_s: float, sends_s: float) -> None:
    lines = [(k + sends_s, rmc(when)) for k, when in enumerate(instants(120))]
    lines += [(k + n / RATE_HZ + 0.03, sentence(f"HEHDT,{k}.{n},T")) for k in range(120) for n in range(RATE_HZ)]
    lines.sort()
    looked = [np.ceil(second - looks_s) + looks_s for second, _ in lines]
    stamped = zip(looked, lines, strict=True)
    readings = read(*(f"{START + timedelta(seconds=at):%FT%T.%f}Z {words}" for at, (_, words) in stamped))
    assert not any("put right" in note for note in readings.notes)
    assert np.abs(late(readings)[RATE_HZ:-RATE_HZ]).max() < 0.2
    # the median fix of its burst seems to come before it was made, or a second after: how far the clocks are apart is
    # known to half of a burst, which to the headings makes the fixes unsure
    fixes, headings = (readings.frame.filter(pl.col("source") == source) for source in ("GPRMC", "HEHDT"))
    assert fixes["instant_std_s"].unique().to_list() == [pytest.approx(12.0**-0.5)]
    assert headings["instant_std_s"].unique().to_list() == [pytest.approx(0.2 / 12.0**0.5)]


def test_what_comes_in_bursts_is_spread_over_the_time_before() -> None:
    def burst(when: datetime) -> str:
        second = (when - START).total_seconds()
        return f"{START + timedelta(seconds=np.ceil(second - 0.5) + 0.5):%Y-%m-%dT%H:%M:%S.%f}Z"

    readings = read(*log(stamp=burst))
    assert readings.tally.records_rejected == 0 and "in bursts, every 1 s (median)" in readings.notes[0]
    # in the first and the last burst there are fewer
    assert np.abs(late(readings)[RATE_HZ:-RATE_HZ]).max() < 0.2
    assert unsure_s(readings) == [pytest.approx(0.2 / 12.0**0.5)]


def bursty(writing_s: float, until_s=lambda second, words: np.ceil(second - 0.5) + 0.5) -> list[str]:
    """The log of a logger that looks at each port once a second, and needs some time to write what came."""
    lines = []
    for line in log():
        when, words = line.split("Z ")
        second = (datetime.fromisoformat(f"{when}+00:00") - START).total_seconds()
        until = until_s(second, words)
        # what came first is written first
        lines.append((until + writing_s * (second - until + 1.0), words))
    lines.sort(key=lambda line: line[0])
    return [f"{START + timedelta(seconds=at):%Y-%m-%dT%H:%M:%S.%f}Z {words}" for at, words in lines]


def test_bursts_that_take_milliseconds_to_write_are_bursts() -> None:
    readings = read(*bursty(0.002))
    assert readings.tally.records_rejected == 0 and "in bursts, every 1 s (median)" in readings.notes[0]
    assert np.abs(late(readings)[RATE_HZ:-RATE_HZ]).max() < 0.2


def test_every_port_has_bursts_of_its_own() -> None:
    def looked_at(second: float, words: str) -> float:
        phase = 0.5 if "HDT" in words else 0.7
        return float(np.ceil(second - phase) + phase)

    readings = read(*bursty(0.0, looked_at))
    assert "in bursts, every 1 s (median)" in readings.notes[0]
    assert np.abs(late(readings)[RATE_HZ:-RATE_HZ]).max() < 0.2


def test_lines_written_twice_are_duplicates_and_no_bursts() -> None:
    readings = read(*(line for once in log() for line in (once, once)))
    assert readings.notes == () and readings.tally.by_reason == {"duplicate": len(log())}
    np.testing.assert_allclose(late(readings), 0.03, atol=1e-6)


def test_a_log_that_holds_a_stretch_twice_has_no_bursts() -> None:
    readings = read(*log(), *log())
    assert not any("bursts" in note or "clock" in note for note in readings.notes[1:])
    assert readings.tally.records_kept == len(log())


def with_fixes(fixes: list[tuple[float, str]], many: int) -> list[str]:
    """Headings as they should be, and fixes of one's own: arrival after the start, s, and sentence."""
    arrived = [(k + n / RATE_HZ + 0.03, sentence(f"HEHDT,{k}.{n},T")) for k in range(many) for n in range(RATE_HZ)]
    lines = sorted([*fixes, *arrived])
    return [f"{START + timedelta(seconds=second):%Y-%m-%dT%H:%M:%S.%f}Z {words}" for second, words in lines]


@pytest.mark.parametrize("ahead_s", [18.0, 1.0])
def test_a_receiver_that_is_ahead_puts_no_clock_right(ahead_s: float) -> None:
    fixes = [(k + 0.1, rmc(when)) for k, when in enumerate(instants(120))]
    fixes += [(k + 0.15, rmc(when + timedelta(seconds=ahead_s), talker="GN")) for k, when in enumerate(instants(120))]
    readings = read(*with_fixes(fixes, 120))
    np.testing.assert_allclose(late(readings), 0.03, atol=1e-6)
    assert any(note.startswith("The clock of GNRMC is") and "ahead of that of GPRMC" in note for note in readings.notes)


def test_a_receiver_s_time_that_leaps_is_not_the_logger_s() -> None:
    # it learns of the leap seconds after 50 s; it says one time for 40 s
    learns = [(k + 0.1, rmc(when + timedelta(seconds=18 if k < 50 else 0))) for k, when in enumerate(instants(150))]
    stands = [(k + 0.1, rmc(instants(150)[min(k, 60) if k < 100 else k])) for k in range(150)]
    for fixes in (learns, stands):
        readings = read(*with_fixes(fixes, 150))
        np.testing.assert_allclose(late(readings), 0.03, atol=1e-6)
        assert any("leaps or stands still" in note for note in readings.notes)


def test_a_date_that_is_late_at_midnight_moves_no_stamp() -> None:
    start = START.replace(hour=23, minute=59, second=0)
    lines = []
    for k in range(120):
        when = start + timedelta(seconds=k)
        dated = when - timedelta(days=1) if 60 <= k < 80 else when
        stamped = when + timedelta(seconds=0.1)
        said = rmc(when).split(",")
        said[9] = f"{dated:%d%m%y}"
        lines += [
            f"{stamped:%Y-%m-%dT%H:%M:%S.%f}Z {sentence(','.join(said)[1:].partition('*')[0])}",
            f"{when + timedelta(seconds=0.5):%Y-%m-%dT%H:%M:%S.%f}Z {sentence(f'HEHDT,{k}.0,T')}",
        ]
    readings = read(*lines)
    assert readings.tally.records_rejected == 0 and not any("clock" in note for note in readings.notes)


def test_stamps_as_they_should_be_are_left_alone() -> None:
    readings = read(*log())
    np.testing.assert_allclose(late(readings), 0.03, atol=1e-6)
    assert readings.notes == () and unsure_s(readings) == [None]


def plain(*others: list[str]) -> list[str]:
    """A log without stamps: a fix a second of GPRMC, five headings behind it, and other sentences between."""
    lines = []
    for k, when in enumerate(instants(60)):
        lines += [rmc(when), *(other[k] for other in others)]
        lines += [sentence(f"HEHDT,{k}.{n},T") for n in range(RATE_HZ)]
    return lines


def zda(when: datetime, talker: str) -> str:
    return sentence(f"{talker}ZDA,{when:%H%M%S}.00,{when:%d,%m,%Y},00,00")


@pytest.mark.parametrize(
    ("other", "named"),
    [
        (lambda when: zda(when + timedelta(seconds=3), "ZQ"), "ZQZDA is 3.0 s ahead of that of GPRMC"),
        (lambda when: zda(when + timedelta(hours=2), "GP"), "GPZDA is 7200.0 s ahead of that of GPRMC"),
        (lambda when: rmc(when - timedelta(seconds=2), talker="GN"), "GNRMC is 2.0 s behind that of GPRMC"),
        (lambda when: rmc(when - timedelta(seconds=2), talker="GL"), "GLRMC is 2.0 s behind that of GPRMC"),
    ],
)
def test_one_clock_dates_the_sentences_without_a_time(other, named: str) -> None:
    alone = late(read(*plain()))
    readings = read(*plain([other(when) for when in instants(60)]))
    np.testing.assert_allclose(late(readings), alone)
    assert any(named in note for note in readings.notes)


def test_a_clock_that_agrees_is_no_other_clock() -> None:
    readings = read(*plain([zda(when, "ZQ") for when in instants(60)]))
    np.testing.assert_allclose(late(readings), late(read(*plain())))
    assert not any("clock" in note for note in readings.notes)


def test_another_receiver_dates_while_the_first_is_silent() -> None:
    when = instants(60)
    lines = []
    for k, at in enumerate(when):
        lines += [rmc(at)] if k < 30 else []
        lines += [rmc(at, talker="II"), *(sentence(f"HEHDT,{k}.{n},T") for n in range(RATE_HZ))]
    # each in the middle of its fifth
    np.testing.assert_allclose(late(read(*lines)), 0.1, atol=1e-6)


def test_a_clock_that_differs_dates_nothing_while_the_receiver_is_silent() -> None:
    when = instants(120)
    lines = []
    for k, at in enumerate(when):
        lines += [rmc(at)] if not 50 <= k < 60 else []
        lines += [zda(at + timedelta(hours=2), "ZQ"), *(sentence(f"HEHDT,{k}.{n},T") for n in range(RATE_HZ))]
    readings = read(*lines)
    assert readings.tally.by_reason == {"no_channel": len(when)}
    # those behind the last fix share it with those of the gap
    sound = np.r_[: 49 * RATE_HZ, 60 * RATE_HZ : 120 * RATE_HZ]
    np.testing.assert_allclose(late(readings)[sound], 0.1, atol=1e-6)


def test_addresses_of_damaged_lines_take_no_time() -> None:
    garbled = [
        sentence(f"HEHDT,{k}.0,T")[:-2].replace("HEHDT", f"H{k % 10}X{k // 10 % 26:02d}") + "00" for k in range(50)
    ]
    assert read(*plain(), *garbled).tally.by_reason["checksum"] == len(garbled)
