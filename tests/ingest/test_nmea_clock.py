"""When a sentence was said: midnights without a date, weeks that overflowed, TAG blocks, line ends."""

from datetime import UTC, datetime, timedelta

import polars as pl
import pytest

from kempf.pipeline.ingest.nmea.decode import decode
from kempf.pipeline.ingest.screen import Screen
from kempf.pipeline.ingest.sniff import sniff


def sentence(body):
    total = 0
    for char in body.encode():
        total ^= char
    return f"${body}*{total:02X}"


def tag(content):
    return sentence(content).replace("$", "\\") + "\\"


def read(*lines, end="\r\n"):
    readings = Screen("nmea").part(decode(end.join([*lines, ""]).encode()))
    tally = readings.tally
    assert tally.records_read == tally.records_kept + tally.records_rejected == len(lines)
    return readings


def times(readings):
    return [datetime.fromtimestamp(t / 1e9, UTC) for t in readings.frame["time_utc_ns"]]


def rmc(when, *, date=True, status="A", talker="GP"):
    day = when.strftime("%d%m%y") if date else ""
    return sentence(f"{talker}RMC,{when:%H%M%S}.00,{status},5954.0,N,02436.0,E,8.0,9.0,{day},,,A")


def gll(when, talker="GP"):
    return sentence(f"{talker}GLL,5954.0,N,02436.0,E,{when:%H%M%S}.00,A")


START = datetime(2025, 5, 3, 18, tzinfo=UTC)


def test_a_date_said_once_holds_for_days():
    when = [START + timedelta(hours=5 * k) for k in range(20)]
    readings = read(rmc(when[0]), *(gll(w) for w in when[1:]))
    assert times(readings) == when


def test_a_date_said_last_holds_backwards():
    when = [START + timedelta(hours=5 * k) for k in range(20)]
    assert times(read(*(gll(w) for w in when[:-1]), rmc(when[-1]))) == when


def test_a_gap_of_days_is_mended_by_the_next_date():
    later = START + timedelta(days=3)
    assert times(read(rmc(START), rmc(later), gll(later + timedelta(hours=1))))[1:] == [
        later,
        later + timedelta(hours=1),
    ]


def test_a_repeater_whose_clock_stands_still_costs_no_day():
    when = [START + timedelta(minutes=7 * k) for k in range(400)]
    stuck = gll(START, talker="II")
    lines = [line for w in when for line in (rmc(w, date=w == START), stuck)]
    readings = read(*lines)
    assert [t for t, s in zip(times(readings), readings.frame["source"], strict=True) if s == "GPRMC"] == when


def test_a_date_that_is_updated_late_at_midnight_is_put_right():
    when = [datetime(2025, 5, 3, 23, 59, 58, tzinfo=UTC) + timedelta(seconds=k) for k in range(8)]
    lines = [rmc(w) for w in when]
    # at midnight the date still is that of the day before
    lines[2] = rmc(when[2]).replace("040525", "030525")
    lines[2] = sentence(lines[2][1:-3])
    readings = read(*lines)
    assert times(readings) == when
    assert any(note.startswith("1 dates that disagree") for note in readings.notes)


@pytest.mark.parametrize("weeks", [1024, 2048])
def test_weeks_that_overflowed_are_recognised_by_the_stamps(weeks):
    early = START - timedelta(weeks=weeks)
    lines = [
        f"{START + timedelta(seconds=k):%Y-%m-%dT%H:%M:%S}.300Z " + rmc(early + timedelta(seconds=k)) for k in range(5)
    ]
    readings = read(*lines)
    assert times(readings) == [START + timedelta(seconds=k) for k in range(5)]
    assert "5 dates were 1024 weeks" in readings.notes[0]


def test_weeks_that_overflowed_are_recognised_by_another_receiver():
    lines = []
    when = [START + timedelta(seconds=k) for k in range(5)]
    for w in when:
        lines += [rmc(w - timedelta(weeks=1024), talker="II"), rmc(w)]
    assert times(read(*lines)) == [w for w in when for _ in range(2)]


def test_weeks_that_overflow_within_the_log_are_counted_on():
    when = [datetime(2019, 4, 6, 23, 59, 58, tzinfo=UTC) + timedelta(seconds=k) for k in range(6)]
    lines = [rmc(w if w.day == 6 else w - timedelta(weeks=1024)) for w in when]
    assert times(read(*lines)) == when


def test_an_old_log_is_no_overflow():
    old = datetime(2005, 9, 17, 12, tzinfo=UTC)
    readings = read(*(rmc(old + timedelta(seconds=k)) for k in range(5)))
    assert times(readings)[0] == old and readings.notes == ()


@pytest.mark.parametrize("end", ["\r", "\n", "\r\n"])
def test_every_line_end(end):
    lines = [rmc(START), sentence("HEHDT,1.0,T"), sentence("SDDPT,5.0,0.0")]
    assert sniff(end.join(lines).encode()) == "nmea"
    assert read(*lines, end=end).frame.height == 3


def test_the_time_of_a_tag_block_is_a_stamp():
    lines = [
        tag("s:GP0001,c:1746295200") + sentence("HEHDT,1.0,T"),
        tag("c:1746295201500,s:GP0001") + sentence("HEHDT,2.0,T"),
        tag("g:1-1-7,n:3,c:1746295202") + sentence("AGRSA,2.0,A,,"),
    ]
    assert times(read(*lines)) == [START, START + timedelta(seconds=1.5), START + timedelta(seconds=2)]


def test_a_tag_block_under_a_wrong_checksum_is_not_believed():
    good = [tag(f"c:{1746295200 + k}") + sentence(f"HEHDT,{k}.0,T") for k in range(4)]
    bad = good[2].replace("c:1746295202", "c:1746295302")
    readings = read(*good[:2], bad, good[3])
    assert readings.tally.by_reason == {"checksum": 1}
    assert readings.rejected["raw"].to_list() == [bad]
    assert "1 TAG blocks have a wrong checksum" in readings.notes[0]


def test_a_tag_block_that_lost_a_backslash_is_reported_and_its_line_refused():
    good = [tag(f"c:{1746295200 + k}") + sentence(f"HEHDT,{k}.0,T") for k in range(4)]
    no_end, no_beginning = good[2].replace("\\$", "-$"), good[3].replace("\\c", "c")
    readings = read(*good[:2], no_end, no_beginning)
    assert readings.tally.by_reason == {"checksum": 2}
    assert readings.rejected["raw"].to_list() == [no_end, no_beginning]
    assert "2 TAG blocks have a wrong checksum or no end" in readings.notes[0]


def test_the_stamp_in_front_of_a_tag_block_without_an_end_counts():
    when = [START + timedelta(seconds=k) for k in range(2)]
    lines = [f"{t.isoformat()} {tag('s:GP0001')}{sentence('HEHDT,1.0,T')}" for t in when]
    readings = read(lines[0], lines[1].replace("\\$", "-$"))
    assert times(readings) == when
    assert "1 TAG blocks" in readings.notes[0]


def test_a_plain_log_keeps_the_sentence_behind_a_broken_tag_block():
    readings = read(rmc(START), "\\c:1746295302*00\\" + sentence("HEHDT,1.0,T"))
    assert times(readings) == [START, START]
    assert "1 TAG blocks" in readings.notes[0]


def test_a_receiver_without_a_fix_gives_no_date_where_another_does():
    lines = [rmc(datetime(1999, 8, 22, tzinfo=UTC), status="V"), rmc(START), sentence("HEHDT,1.0,T")]
    readings = read(*lines)
    assert times(readings) == [START, START]
    assert readings.tally.by_reason == {"void": 1}


def test_sentences_faster_than_the_fix_are_spread_over_the_time_between_two():
    lines = []
    for k in range(4):
        lines += [rmc(START + timedelta(seconds=k)), *(sentence(f"HEHDT,{k}.{j},T") for j in range(5))]
    readings = read(*lines)
    heading = readings.frame.filter(readings.frame["source"] == "HEHDT")["time_utc_ns"].to_numpy()
    # each in the middle of its fifth
    assert (heading - int(START.timestamp()) * 10**9).tolist() == [k * 200_000_000 + 100_000_000 for k in range(20)]
    assert readings.notes[0].endswith("spread evenly over it: HEHDT.")


def test_what_is_not_known_of_instants_without_a_stamp_is_kept_with_them():
    lines = []
    for k in range(30):
        lines += [rmc(START + timedelta(seconds=k)), *(sentence(f"HEHDT,{k}.{j},T") for j in range(5))]
        # said by the receiver, with its fix; and by an instrument, some time until the next one
        lines += [sentence("GPVTG,10.0,T,,M,8.0,N,14.8,K,A"), sentence(f"TIROT,{k / 10},A")]
    frame = read(*lines).frame
    std_s = dict(frame.group_by("source").agg(pl.col("instant_std_s").unique().item()).iter_rows())
    # a fifth of a second; a second on either side; and up to half a second until a fix was sent
    parts = {"HEHDT": 0.2, "TIROT": 2.0, "GPRMC": 1.0, "GPVTG": 1.0}
    assert std_s == {source: pytest.approx(part_s / 12.0**0.5) for source, part_s in parts.items()}
    # nothing else is dated by the fixes
    frame = read(*(line for line in lines if line[3:6] in ("RMC", "VTG"))).frame
    assert frame["instant_std_s"].is_null().all()


def test_a_pause_of_the_log_is_not_filled():
    when = [START + timedelta(seconds=s) for s in (0, 1, 2, 3, 600, 601)]
    lines = [
        line for w in when for line in (rmc(w), sentence(f"HEHDT,{w.second}.0,T"), sentence(f"HEHDT,{w.second}.5,T"))
    ]
    readings = read(*lines)
    heading = [t for t, s in zip(times(readings), readings.frame["source"], strict=True) if s == "HEHDT"]
    assert heading[7] - heading[6] == timedelta(seconds=1.5)
    assert heading[9] - heading[8] == timedelta(seconds=0.5)


def test_two_transducer_sentences_of_one_instant_stay_together():
    lines = []
    for k in range(4):
        roll, pitch = sentence(f"YXXDR,A,{k}.0,D,ROLL"), sentence(f"YXXDR,A,{k}.5,D,PTCH")
        lines += [rmc(START + timedelta(seconds=k)), roll, pitch]
    assert set(times(read(*lines))) == {START + timedelta(seconds=k) for k in range(4)}


def test_a_log_of_carriage_returns_that_begins_in_the_middle_of_a_line_is_recognised_by_its_content():
    assert sniff(b"54.0,N,0\r" + b"\r".join(sentence(f"HEHDT,{k}.0,T").encode() for k in range(9))) == "nmea"


def test_a_line_without_a_sentence_before_one_with_two_changes_nothing():
    readings = Screen("nmea").part(decode((rmc(START) + "\nnothing\n$HE" + sentence("HEHDT,1.0,T") + "\n").encode()))
    assert readings.tally.by_reason == {"checksum": 1, "malformed": 1}
