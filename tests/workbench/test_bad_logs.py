"""Logs as they come: useless ones are refused whole, damaged ones lose what is damaged, and every loss is counted."""

from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import pytest

from tests.conftest import Ship
from tests.workbench.driving import Ran, kempf, refused, tree, versions


def take_in(place: Path, path: Path, *more: object, vessel: str = "mariner") -> Ran:
    return kempf("ingest", path, "--vessel", vessel, *more, "--warehouse", place, "--json")


def one(ran: Ran) -> dict[str, Any]:
    """The outcome of the one log, its ledgers closed."""
    assert ran.code == 0, ran
    (outcome,) = ran.json
    assert outcome["outcome"] == "new"
    for ledger in (outcome["records"], outcome["values"]):
        assert ledger["read"] == ledger["kept"] + ledger["rejected"]
    refused_in_all = outcome["records"]["rejected"] + outcome["values"]["rejected"]
    assert refused_in_all == sum(outcome["rejected_by_reason"].values())
    return dict(outcome)


def clean(ship: Ship) -> list[bytes]:
    """The lines of the NMEA log without those that the simulator damaged."""
    good = []
    for line in ship.lines:
        body = line.partition(b"$")[2].partition(b"*")
        total = 0
        for byte in body[0]:
            total ^= byte
        if body[2].strip() == b"%02X" % total:
            good.append(line)
    return good


@pytest.mark.parametrize(
    ("name", "data", "exit_code", "code"),
    [
        ("empty.nmea", b"", 3, "empty_log"),
        ("empty.gz", gzip.compress(b"", mtime=0), 3, "unknown_format"),
        ("report.pdf", b"%PDF-1.7\n% trial report\n", 3, "unknown_format"),
        ("workbook.csv", b"PK\x03\x04\x14\x00\x06\x00" + bytes(range(256)), 3, "unknown_format"),
        ("picture.png", b"\x89PNG\r\n\x1a\n" + bytes(range(256)) * 20, 3, "unknown_format"),
        ("zeros.bin", bytes(10_000), 3, "unknown_format"),
        ("cut.mcap", b"\x89MCAP0\r\n", None, None),
        ("letter.txt", b"Dear Sirs,\nthe log is lost.\n", 2, "no_source_for_log"),
        ("bad.gz", b"\x1f\x8b\x08\x00garbage that is no deflate stream", 3, "damaged_gzip"),
    ],
)
def test_a_file_that_is_no_log(own: Path, tmp_path: Path, name: str, data: bytes, exit_code: int | None, code: str):
    path = tmp_path / name
    path.write_bytes(data)
    before, at = tree(own), versions(own)
    ran = take_in(own, path)
    if code is None:
        assert ran.code in (2, 3) and set(ran.json) == {"error"}
    else:
        assert exit_code is not None
        assert name in refused(ran, exit_code, code)["message"]
    assert (tree(own), versions(own)) == (before, at)
    human = kempf("ingest", path, "--vessel", "mariner", "--warehouse", own)
    assert human.out == "" and human.err.startswith("error [") and len(human.err.splitlines()) == 2


def test_a_useless_log_makes_no_warehouse(tmp_path: Path):
    (tmp_path / "empty.nmea").touch()
    refused(take_in(tmp_path / "w", tmp_path / "empty.nmea"), 3, "empty_log")
    assert not (tmp_path / "w").exists()


@pytest.mark.parametrize(("sentence", "channel"), [(b"RSA", "rudder_angle"), (b"HDT", "heading")])
def test_a_log_without_rudder_or_heading_is_kept_and_says_so(
    mariner: Ship, tmp_path: Path, sentence: bytes, channel: str
):
    path, place = tmp_path / "day.nmea", tmp_path / "w"
    path.write_bytes(b"".join(line for line in clean(mariner) if sentence not in line))
    outcome = one(take_in(place, path))
    assert outcome["segments"] == []
    note = f"no {channel} in this log: manoeuvres cannot be looked for; map it in the profile if the log has it"
    assert note in outcome["notes"]
    assert kempf("segments", "--warehouse", place, "--json").json == []
    assert kempf("segments", "--warehouse", place).out == "No zigzag found.\n"
    error = refused(kempf("identify", "--vessel", "mariner", "--warehouse", place, "--json"), 4, "no_segments")
    assert error["details"]["logs"] == ["day.nmea"]
    # what is said once is said again
    (again,) = take_in(place, path).json
    assert (again["outcome"], again["notes"]) == ("unchanged", outcome["notes"])
    (listed,) = kempf("logs", "list", "--warehouse", place, "--json").json
    assert note in listed["notes"]


def test_a_clock_that_jumps_back(mariner: Ship, tmp_path: Path):
    lines = clean(mariner)
    late = len(lines) // 2
    jumped = [
        line.replace(b"2025-05-03T06:", b"2025-05-03T05:", 1) if late <= k < late + 20 else line
        for k, line in enumerate(lines)
    ]
    (tmp_path / "day.nmea").write_bytes(b"".join(jumped))
    outcome = one(take_in(tmp_path / "w", tmp_path / "day.nmea"))
    # sentences with a clock of their own are not late, the line's stamp is
    assert 0 < outcome["rejected_by_reason"]["clock_back"] <= 20
    assert outcome["records"]["rejected"] == sum(outcome["rejected_by_reason"].values())
    assert len(outcome["segments"]) == 1
    output = kempf("logs", "rejected", "day.nmea", "--warehouse", tmp_path / "w", "--json").json
    assert {row["reason"] for row in output["rows"]} == {"clock_back"}


def test_a_clock_that_was_never_set(mariner: Ship, own: Path, tmp_path: Path):
    path = tmp_path / "day.csv.gz"
    path.write_bytes(gzip.compress(gzip.decompress(mariner.csv).replace(b"2025-", b"1980-"), mtime=0))
    before = tree(own)
    error = refused(take_in(own, path), 3, "no_valid_reading")
    assert "1980" in error["message"] and "clock" in error["next_step"]
    assert tree(own) == before


def test_a_stretch_of_1980_is_counted_and_the_rest_is_kept(mariner: Ship, tmp_path: Path):
    rows = gzip.decompress(mariner.csv).splitlines(keepends=True)
    rows[1:51] = [row.replace(b"2025-", b"1980-", 1) for row in rows[1:51]]
    (tmp_path / "day.csv").write_bytes(b"".join(rows))
    profile = mariner.write(tmp_path) / "profile.yaml"
    outcome = one(take_in(tmp_path / "w", tmp_path / "day.csv", "--profile", profile))
    assert outcome["rejected_by_reason"] == {"clock_unset": 50}
    assert len(outcome["segments"]) == 1


def test_lines_that_come_twice_count_once(mariner: Ship, tmp_path: Path):
    lines = clean(mariner)
    (tmp_path / "once.nmea").write_bytes(b"".join(lines))
    (tmp_path / "twice.nmea").write_bytes(b"".join(line for one in lines for line in (one, one)))
    once = one(take_in(tmp_path / "a", tmp_path / "once.nmea"))
    twice = one(take_in(tmp_path / "b", tmp_path / "twice.nmea"))
    assert twice["records"]["kept"] == once["records"]["kept"]
    assert twice["rejected_by_reason"]["duplicate"] == once["records"]["kept"]
    found = [kempf("segments", "--warehouse", tmp_path / name, "--json").json[0] for name in "ab"]
    assert found[0]["executes"] == found[1]["executes"]


def test_latitude_95(mariner: Ship, tmp_path: Path):
    rows = [row.split(b",") for row in gzip.decompress(mariner.csv).splitlines()]
    at = rows[0].index(b"lat")
    for row in rows[100:110]:
        row[at] = b"95.0"
    (tmp_path / "day.csv").write_bytes(b"\n".join(b",".join(row) for row in rows) + b"\n")
    profile = mariner.write(tmp_path) / "profile.yaml"
    outcome = one(take_in(tmp_path / "w", tmp_path / "day.csv", "--profile", profile))
    assert outcome["rejected_by_reason"] == {"out_of_range": 10}
    assert (outcome["records"]["rejected"], outcome["values"]["rejected"]) == (0, 10)
    output = kempf("logs", "rejected", "day.csv", "--warehouse", tmp_path / "w", "--json").json
    assert {(row["channel"], row["reason"]) for row in output["rows"]} == {("latitude", "out_of_range")}
    assert all("95.0" in row["raw"] for row in output["rows"])


def test_the_same_bytes_for_another_vessel(own: Path, logs: Path, tmp_path: Path):
    copy = tmp_path / "other name.nmea.gz"
    copy.write_bytes((logs / "mariner.nmea.gz").read_bytes())
    before = tree(own)
    error = refused(take_in(own, copy, "--new-vessel", vessel="aurora"), 3, "log_of_another_vessel")
    assert error["details"]["held_by"] == "mariner"
    assert tree(own) == before


def test_one_bad_log_among_good_ones(ferry: Ship, tmp_path: Path):
    folder = ferry.write(tmp_path / "logs")
    (folder / "bad.nmea").write_bytes(b"\x00" * 5000)
    (folder / "later.nmea").touch()
    paths = [folder / name for name in ("ferry.nmea.gz", "bad.nmea", "ferry.csv.gz", "later.nmea", "ferry.mcap")]
    asked = ("ingest", *paths, "--profile", folder / "profile.yaml", "--warehouse")
    output = kempf(*asked, tmp_path / "w", "--json")
    assert output.code == 3
    assert [o["outcome"] for o in output.json] == ["new", "failed", "new", "failed", "new"]
    failed = [o["error"]["code"] for o in output.json if o["outcome"] == "failed"]
    assert failed == ["unknown_format", "empty_log"]
    assert [o["log_id"] is None for o in output.json] == [False, True, False, True, False]
    assert len(kempf("segments", "--warehouse", tmp_path / "w", "--json").json) == 3
    human = kempf(*asked, tmp_path / "other")
    assert human.code == 3
    assert human.err.count("failed [") == 2 and human.out.count(": new, ") == 3


def test_the_worst_fault_gives_the_exit_code(mariner: Ship, tmp_path: Path):
    folder = mariner.write(tmp_path / "logs")
    (folder / "bad.nmea").touch()
    paths = (folder / "gone", folder / "bad.nmea", folder / "mariner.nmea.gz")
    output = kempf("ingest", *paths, "--vessel", "mariner", "--warehouse", tmp_path / "w", "--json")
    assert output.code == 4
    assert [o["outcome"] for o in output.json] == ["failed", "failed", "new"]


def test_a_fault_of_our_own_on_one_log_stops_no_other(mariner: Ship, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    from kempf.flows.jobs.ingest import ingest_logs

    def read(name: str, log: Any, profile: Any) -> Any:
        if name.endswith("mcap"):
            raise ZeroDivisionError("division by zero")
        return real(name, log, profile)

    real = ingest_logs.spooled
    monkeypatch.setattr(ingest_logs, "spooled", read)
    folder = mariner.write(tmp_path / "logs")
    paths = [folder / name for name in ("mariner.mcap", "mariner.nmea.gz")]
    output = kempf("ingest", *paths, "--profile", folder / "profile.yaml", "--warehouse", tmp_path / "w", "--json")
    assert output.code == 1
    assert [o["outcome"] for o in output.json] == ["failed", "new"]
    assert output.json[0]["error"]["code"] == "internal"


def test_the_second_time_changes_nothing(own: Path, logs: Path):
    before, at = tree(own), versions(own)
    output = kempf("ingest", *sorted(logs.glob("*gz")), "--vessel", "mariner", "--warehouse", own, "--json")
    assert [o["outcome"] for o in output.json] == ["unchanged", "unchanged"]
    assert all(o["segments"] for o in output.json)
    assert (tree(own), versions(own)) == (before, at)


def test_the_same_log_twice_in_one_command(mariner: Ship, tmp_path: Path):
    folder = mariner.write(tmp_path / "logs")
    (folder / "copy.nmea.gz").write_bytes(mariner.nmea)
    paths = [folder / name for name in ("mariner.nmea.gz", "mariner.nmea.gz", "copy.nmea.gz")]
    output = kempf("ingest", *paths, "--vessel", "mariner", "--warehouse", tmp_path / "w", "--json")
    assert [o["outcome"] for o in output.json] == ["new", "unchanged", "unchanged"]
    assert len(kempf("segments", "--warehouse", tmp_path / "w", "--json").json) == 1


def test_another_profile_reads_the_log_anew(own: Path, logs: Path, tmp_path: Path):
    (tmp_path / "p.yaml").write_text("wind_arm_per_m: 0.001\n")
    output = take_in(own, logs / "mariner.nmea.gz", "--profile", tmp_path / "p.yaml")
    (outcome,) = output.json
    assert outcome["outcome"] == "reread" and len(outcome["segments"]) == 1
    assert len(kempf("segments", "--warehouse", own, "--json").json) == 2
    assert len(kempf("logs", "list", "--warehouse", own, "--json").json) == 2
