"""Every command: what it says to a person, its JSON keys, its exit code."""

from __future__ import annotations

import gzip
import re
import subprocess
import sys
from datetime import datetime
from pathlib import Path

import pytest
import yaml

from kempf.workbench.cli.diagnose import next_commands
from kempf.workbench.cli.entry import COMMANDS
from tests.conftest import Ship
from tests.workbench.driving import HULL, kempf, refused, tree, versions

#: Keys that people script against: DESIGN's, which may be joined by more but never lost.
SEGMENT = {
    *("segment_id", "vessel", "log", "kind", "psi0_deg", "delta0_deg", "first_side", "base_heading_deg", "start"),
    *("end", "executes", "overshoots_deg", "imo", "quality"),
}


def test_every_command_has_help_and_a_summary():
    whole = kempf("--help")
    assert whole.code == 0
    for name in COMMANDS:
        assert f"\n  {name} " in whole.out
        output = kempf(name, "--help")
        assert output.code == 0
        assert output.out.startswith(f"Usage: kempf {name} ")


def test_without_a_command_the_help_is_shown_and_it_is_a_usage_error():
    for arguments in ((), ("params",), ("vessels",)):
        output = kempf(*arguments)
        assert (output.code, output.out) == (2, "")
        assert output.err.startswith("Usage: kempf")
        assert "error [" not in output.err


def test_ingest_prints_every_log_with_its_ledger(logs: Path, tmp_path: Path):
    paths = sorted(logs.glob("mariner.*"))
    output = kempf("ingest", *paths, "--profile", logs / "profile.yaml", "--warehouse", tmp_path)
    assert output.code == 0
    lines = [line for line in output.out.splitlines() if line.startswith("mariner.")]
    assert len(lines) == 3
    assert all(": new, " in line and "1 zigzag: 20/20 to starboard" in line for line in lines)
    assert "rejected (" in output.out and "next: kempf segments" in output.out


def test_ingest_json_closes_both_ledgers(filled: Path, logs: Path):
    profile = logs / "profile.yaml"
    output = kempf("ingest", *sorted(logs.glob("*gz")), "--profile", profile, "--warehouse", filled, "--json").json
    assert [one["outcome"] for one in output] == ["unchanged", "unchanged"]
    for one in output:
        for ledger in (one["records"], one["values"]):
            assert ledger["read"] == ledger["kept"] + ledger["rejected"] > 0
        assert one["segments"]
    nmea = output[1]
    assert sum(nmea["rejected_by_reason"].values()) == nmea["records"]["rejected"] + nmea["values"]["rejected"] > 0


def test_segments(filled: Path):
    found = kempf("segments", "--warehouse", filled, "--json").json
    assert len(found) == 2
    for one in found:
        assert set(one) >= SEGMENT
        assert (one["vessel"], one["kind"], one["psi0_deg"], one["delta0_deg"]) == ("mariner", "zigzag", 20.0, 20.0)
        assert datetime.fromisoformat(one["start"]) < datetime.fromisoformat(one["executes"][0])
        assert one["executes"] == sorted(one["executes"])
        assert len(one["overshoots_deg"]) >= 1
    assert kempf("segments", "--vessel", "mariner", "--warehouse", filled, "--json").json == found
    output = kempf("segments", "--warehouse", filled)
    assert output.code == 0
    assert all(one["segment_id"][:12] in output.out for one in found), "the beginning distinguishes them"
    assert len({one["start"][:16] for one in found}) == 1
    assert all(Path(one["log"]).name in output.out for one in found), "those that begin alike are named by their logs"


def test_reprocess_of_one_vessel(filled: Path):
    before = versions(filled)
    output = kempf("reprocess", "--vessel", "mariner", "--vessel", "mariner", "--warehouse", filled.parent / "none")
    assert output.code == 4  # before anything is done
    assert versions(filled) == before


def test_reprocess_of_one_vessel_changes_nothing_but_the_runs(own: Path):
    before = versions(own)
    output = kempf("reprocess", "--vessel", "mariner", "--warehouse", own, "--json")
    assert output.code == 0
    (report,) = output.json
    assert (report["status"], report["logs"], report["reread"], report["kept_sets"]) == ("unchanged", 2, 0, 4)
    after = versions(own)
    assert {name: v for name, v in after.items() if name != "runs"} == before
    human = kempf("reprocess", "--vessel", "mariner", "--warehouse", own)
    assert human.code == 0 and "unchanged" in human.out
    assert versions(own) == after


def test_vessels(own: Path, logs: Path, tmp_path: Path):
    assert kempf("vessels", "list", "--warehouse", own, "--json").json == [
        {"vessel": "mariner", "logs": 2, "segments": 2, "parameter_sets": 4}
    ]
    assert "mariner" in kempf("vessels", "list", "--warehouse", own).out
    shown = kempf("vessels", "show", "mariner", "--warehouse", own, "--json").json
    assert shown["profile"]["vessel"] == "mariner" and len(shown["versions"]) == 1
    human = kempf("vessels", "show", "mariner", "--warehouse", own)
    assert yaml.safe_load(human.out) == shown["profile"]
    same = kempf("vessels", "set", "mariner", "--profile", logs / "profile.yaml", "--warehouse", own, "--json")
    assert same.json == {"vessel": "mariner", "changed": False}
    wider = tmp_path / "wider.yaml"
    wider.write_text("length_m: 200.0\n")
    changed = kempf("vessels", "set", "mariner", "--profile", wider, "--warehouse", own, "--json")
    assert changed.json == {"vessel": "mariner", "changed": True}
    assert len(kempf("vessels", "show", "mariner", "--warehouse", own, "--json").json["versions"]) == 2


def test_the_history_of_several_vessels_shows_them_all(own: Path, ferry: Ship, tmp_path: Path):
    folder = ferry.write(tmp_path / "ferry")
    done = kempf("ingest", folder / "ferry.csv.gz", "--profile", folder / "profile.yaml", "--warehouse", own)
    assert done.code == 0, done
    assert kempf("identify", "--vessel", "ferry", "--estimator", "least-squares", "--warehouse", own).code == 0
    asked = ("history", "--parameter", "b2", "--warehouse", own)
    both = ("--vessel", "mariner", "--vessel", "ferry")
    rows = kempf(*asked, *both, "--json").json
    alone = [kempf(*asked, "--vessel", name, "--json").json for name in ("mariner", "ferry")]
    assert rows == [*alone[0], *alone[1]] and {row["vessel"] for row in rows} == {"mariner", "ferry"}
    table = kempf(*asked, *both).out.splitlines()
    titles = [line for line in table if ", model " in line]
    assert {title.partition(",")[0] for title in titles} == {"mariner", "ferry"}
    # a table a vessel, model and estimator: its title and head, then its rows
    assert len(table) == 2 * len(titles) + len(rows)
    changes = kempf("history", *both, "--changes", "--warehouse", own, "--json").json
    assert [one["vessel"] for one in changes] == ["mariner", "ferry"]


def test_a_second_vessel_is_not_dropped(filled: Path):
    output = kempf("segments", "--vessel", "mariner", "--vessel", "ferry", "--warehouse", filled, "--json")
    assert "--vessel is given 2 times" in refused(output, 2, "usage")["message"]


def test_what_is_counted_of_a_log_adds_up(mariner: Ship, tmp_path: Path):
    header, *rows = gzip.decompress(mariner.csv).splitlines(keepends=True)
    place = header.split(b",").index(b"heading")
    for k in (100, 200, 300):
        cells = rows[k].split(b",")
        cells[place] = b"7000"
        rows[k] = b",".join(cells)
    folder = mariner.write(tmp_path / "logs")
    (tmp_path / "day.csv").write_bytes(b"".join([header, *rows[:5000], b"broken\n", *rows[5000:]]))
    asked = ("--profile", folder / "profile.yaml", "--warehouse", tmp_path / "w")
    output = kempf("ingest", tmp_path / "day.csv", *asked).out
    assert re.search(r"(\d+) records read = (\d+) kept \+ (\d+) rejected; (\d+) values in the kept ones = ", output)
    (one,) = kempf("logs", "list", "--warehouse", tmp_path / "w", "--json").json
    for what in ("records", "values"):
        assert one[f"{what}_read"] == one[f"{what}_kept"] + one[f"{what}_rejected"] > one[f"{what}_kept"]
    assert sum(one["rejected_by_reason"].values()) == one["records_rejected"] + one["values_rejected"]
    assert f"{one['values_rejected']} values of kept records" in kempf("logs", "rejected", "day.csv", *asked[2:]).out


def test_logs_and_what_was_refused_in_them(filled: Path):
    listed = kempf("logs", "list", "--warehouse", filled, "--json").json
    assert [one["format"] for one in listed] == ["nmea", "delimited"]
    assert "mariner.nmea.gz" in kempf("logs", "list", "--vessel", "mariner", "--warehouse", filled).out
    for name in (listed[0]["log_id"], listed[0]["log_id"][:8], listed[0]["file_name"], listed[0]["ingest_id"]):
        output = kempf("logs", "rejected", name, "--limit", "3", "--warehouse", filled, "--json").json
        assert output["rejected"] == sum(listed[0]["rejected_by_reason"].values())
        assert output["shown"] == len(output["rows"]) == 3
        assert all(row["reason"] and row["raw"] for row in output["rows"])
    assert "more, see --limit" in kempf("logs", "rejected", name, "--limit", "1", "--warehouse", filled).out
    refused(kempf("logs", "rejected", "nothing", "--warehouse", filled, "--json"), 4, "no_log")
    refused(kempf("logs", "rejected", "", "--warehouse", filled, "--json"), 4, "no_log")
    refused(kempf("logs", "rejected", name, "--limit", "-1", "--warehouse", filled, "--json"), 2, "usage")


@pytest.mark.parametrize("shell", ["bash", "zsh", "fish"])
def test_completion(shell: str):
    output = kempf("completion", shell)
    assert output.code == 0
    assert "_KEMPF_COMPLETE" in output.out
    refused(kempf("completion", "tcsh", "--json"), 2, "usage")


def test_the_version_is_that_of_the_package():
    from importlib.metadata import version

    assert kempf("--version").out == f"kempf, version {version('kempf')}\n"
    as_module = subprocess.run([sys.executable, "-m", "kempf", "--version"], capture_output=True, text=True, check=True)
    assert as_module.stdout.endswith(f", version {version('kempf')}\n")


def test_what_comes_after_a_diagnosis_is_all_that_it_names():
    sets = [{"effects": ["propeller_wash"]}, {"effects": ["wind_force"]}, {"effects": ["cross_flow_drag", "yaw_v3"]}]
    assert next_commands({"vessel": "osaka", "sets": sets}) == [
        "kempf effects add propeller_wash --vessel osaka",
        "kempf effects add wind_force --vessel osaka",
        "kempf effects add cross_flow_drag --vessel osaka",
        "kempf ladder --vessel osaka",
    ]


@pytest.mark.parametrize(
    "arguments",
    [
        ("nonsense",),
        ("segments", "--nonsense"),
        ("segments", "extra"),
        ("ingest",),
        ("identify",),
        ("identify", "--vessel", "x", "--estimator", "guess"),
        ("history", "--occasion", "long"),
        ("rerun", "x", "--tolerance", "much"),
        ("params", "nonsense"),
        ("params", "export", "x", "--format", "xls"),
        ("params", "diff", "x"),
    ],
)
def test_a_wrong_request_says_where_to_look(arguments: tuple[str, ...]):
    error = refused(kempf(*arguments, "--json"), 2, "usage")
    assert "--help`" in error["next_step"]
    human = kempf(*arguments)
    assert (human.code, human.out) == (2, "")
    assert human.err.startswith("error [usage] ")


def test_the_warehouse_may_be_named_by_the_environment(filled: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path):
    monkeypatch.chdir(tmp_path)
    refused(kempf("segments", "--json"), 4, "no_warehouse")
    monkeypatch.setenv("KEMPF_WAREHOUSE", str(filled))
    assert len(kempf("segments", "--json").json) == 2
    refused(kempf("segments", "--warehouse", tmp_path / "other", "--json"), 4, "no_warehouse")
    assert tree(tmp_path) == {}


def test_the_demonstration_finds_the_truth(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    from kempf.flows.jobs.demo import demonstrate

    monkeypatch.setattr(demonstrate, "_DAYS", demonstrate._DAYS[1:2])  # one day is quicker than three
    human = kempf("demo", "--folder", tmp_path / "demo")
    assert human.code == 0
    assert "Zigzags found" in human.out and "2 of 2 parameter sets bit-identical" in human.out
    assert human.out.count("error in std") == 2
    zigzags = human.out.partition("Zigzags found")[2].partition("\n\n")[0].splitlines()
    assert [sum(line.split()[:1] == [angles] for line in zigzags) for angles in ("20/20", "10/10")] == [1, 1]
    at = versions(tmp_path / "demo" / "warehouse")
    output = kempf("demo", "--folder", tmp_path / "demo", "--json").json
    assert set(output) == {"folder", "vessel", "truth", "ingested", "parameter_sets", "reruns"}
    assert list(output["truth"]) == HULL
    assert [o["outcome"] for o in output["ingested"]] == ["unchanged"]
    assert {r["verdict"] for r in output["reruns"]} == {"bit-identical"}
    for made in output["parameter_sets"]:
        for name, true in output["truth"].items():
            found = made["parameters"][name]
            assert abs(found["value"] - true) < 4 * found["std"], name
    assert versions(tmp_path / "demo" / "warehouse") == at


def test_a_fault_of_our_own_is_reported_as_one(filled: Path, monkeypatch: pytest.MonkeyPatch):
    from kempf.warehouse.tables import logs

    def broken(*_: object) -> None:
        raise ZeroDivisionError("division by zero")

    monkeypatch.setattr(logs, "current", broken)
    output = kempf("segments", "--warehouse", filled, "--json")
    assert output.code == 1
    assert output.json["error"]["code"] == "internal"
    assert "ZeroDivisionError: division by zero" in output.json["error"]["message"]
    assert "Traceback" in output.err
