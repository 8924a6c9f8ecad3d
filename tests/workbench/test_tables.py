"""The tables for analysts: written by one command, read by SQL, by polars and by a spreadsheet."""

from __future__ import annotations

import ast
import csv
import json
import re
from datetime import UTC, datetime, timedelta
from pathlib import Path

import polars as pl
import pytest

from kempf.flows.jobs.corrections.correct_segments import plan_for
from kempf.flows.jobs.ingest.files import read_profiles
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.reprocess.reprocess_vessel import reprocess_vessel
from kempf.warehouse.queries import history
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import parameter_sets, segments
from kempf.warehouse.upkeep import compaction
from tests.conftest import Ship
from tests.warehouse.samples import inputs, parameter_set
from tests.workbench.driving import kempf

duckdb = pytest.importorskip("duckdb", reason="duckdb is not installed: no SQL to try")
ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def place(mariner: Ship, ferry: Ship, tmp_path_factory: pytest.TempPathFactory) -> Warehouse:
    folder = tmp_path_factory.mktemp("tables")
    warehouse = Warehouse(str(folder / "w"))
    for ship, name in ((mariner, "mariner"), (ferry, "ferry")):
        path = ship.write(folder / name)
        ingest(warehouse, [path / f"{name}.nmea.gz"], given=read_profiles([path / "profile.yaml"]))
        reprocess_vessel(warehouse, name)
    (zigzag,) = segments.current(warehouse, "ferry")
    plan_for(warehouse, zigzag.segment_id, "exclude", "engine slowed").store(warehouse)
    return warehouse


@pytest.fixture(scope="module")
def written(place: Warehouse, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("out") / "tables"
    for _ in range(2):  # a second call replaces the files
        output = kempf("export", "tables", folder, "--warehouse", place.uri, "--json")
        assert output.code == 0
    assert sorted(path.name for path in folder.iterdir()) == [
        f"{name}.parquet" for name in ("log_quality", "manoeuvres", "parameter_history", "run_history")
    ]
    assert output.json["rows"]["manoeuvres"] == 2
    return folder


def sql(folder: Path, query: str) -> list[tuple[object, ...]]:
    found: list[tuple[object, ...]] = duckdb.connect().execute(query.replace("TABLES", str(folder))).fetchall()
    return found


def test_parameters_are_a_row_each(place: Warehouse, written: Path) -> None:
    rows = sql(
        written,
        "select vessel, parameter, value, std, unit, converged, superseded, current, stored_at, epoch_us(start_at) "
        "from 'TABLES/parameter_history.parquet' where parameter = 'b2' order by vessel",
    )
    assert [(row[0], row[4], row[5], row[6], row[7]) for row in rows] == [
        ("ferry", "1/m^2", True, True, False),
        ("mariner", "1/m^2", True, False, True),
    ]
    (own,) = history.of_vessel(place, "mariner", "b2").rows()
    assert (rows[1][2], rows[1][3]) == (own["value"], own["std"]) and rows[1][9] == own["start_utc_ns"] // 1000
    stored = rows[1][8]
    assert isinstance(stored, datetime) and timedelta(0) < datetime.now(UTC) - stored.astimezone(UTC) < timedelta(1)


def test_a_set_was_stored_when_the_commit_that_brought_it_was_made(tmp_path: Path) -> None:
    warehouse = Warehouse(str(tmp_path / "w"))
    # both made beside a warehouse without sets, as those of parallel batches are
    made = [parameter_set(made_of=inputs(letter * 64)) for letter in "ab"]
    for one in made:
        parameter_sets.insert(warehouse, [one])
    with delta.reading(warehouse, "parameter_sets") as table:
        assert table is not None
        times = delta.commit_times(table)
    first, second = (one.parameter_set_id for one in made)
    stored = parameter_sets.stored_at_ms(warehouse)
    assert stored == {first: times[1], second: times[2]}
    compaction.compact(warehouse, 1)
    compaction.vacuum(warehouse, 0.0)
    assert parameter_sets.stored_at_ms(warehouse) == stored


def test_manoeuvres_logs_and_runs(written: Path) -> None:
    ferry, mariner = sql(written, "select vessel, kind, excluded, overshoot_1_deg from 'TABLES/manoeuvres.parquet'")
    assert (ferry[2], mariner[2]) == ("engine slowed", None) and isinstance(mariner[3], float)
    logs = sql(
        written, "select records_read = records_kept + records_rejected, zigzags from 'TABLES/log_quality.parquet'"
    )
    assert logs == [(True, 1), (True, 1)]
    runs = sql(written, "select vessel, status, new_sets, failures from 'TABLES/run_history.parquet' order by run_at")
    assert runs == [("mariner", "changed", 1, 0), ("ferry", "changed", 1, 0)]
    frame = pl.scan_parquet(written / "parameter_history.parquet").filter(pl.col("vessel") == "mariner").collect()
    assert frame.schema["start_at"] == pl.Datetime("us", "UTC") and frame.height == 6


def test_the_dashboard_asks_what_the_tables_answer(written: Path) -> None:
    dashboard = json.loads((ROOT / "docs" / "grafana" / "kempf.json").read_text(encoding="utf-8"))
    queries = [target["rawSql"] for panel in dashboard["panels"] for target in panel["targets"]]
    assert len(queries) >= 4
    for query in queries:
        filled = re.sub(r"\$\{?vessel\}?", "mariner", query).replace("${tables}", str(written))
        assert "$" not in filled, query
        assert sql(written, filled), query


def test_tables_as_text(place: Warehouse, tmp_path: Path) -> None:
    assert kempf("export", "tables", tmp_path / "t", "--format", "csv", "--warehouse", place.uri).code == 0
    with (tmp_path / "t" / "manoeuvres.csv").open(newline="", encoding="utf-8") as stream:
        assert [row["vessel"] for row in csv.DictReader(stream)] == ["ferry", "mariner"]
    (tmp_path / "file").touch()
    refused = kempf("export", "tables", tmp_path / "file", "--warehouse", place.uri)
    assert refused.code == 2


def test_history_of_the_fleet_in_three_forms(place: Warehouse, tmp_path: Path) -> None:
    at = ("--warehouse", place.uri)
    fleet = kempf("history", "--all", *at, "--json").json
    assert {row["vessel"] for row in fleet} == {"mariner", "ferry"}
    for ending, read in (("csv", pl.read_csv), ("parquet", pl.read_parquet), ("json", pl.read_json)):
        path = tmp_path / f"history.{ending}"
        assert kempf("history", "--all", "--format", ending, "--output", path, *at).code == 0
        frame = read(path)  # type: ignore[operator]
        assert frame["value"].to_list() == [row["value"] for row in fleet]
    again = kempf("history", "--format", "csv", "--output", tmp_path / "history.csv", *at)
    assert again.code == 2 and "it is there already" in again.err
    alone = kempf("history", "--format", "csv", *at, "--json")
    assert alone.json["error"]["code"] == "format_without_output"
    for other in ("--changes", "--json"):
        both = kempf("history", "--format", "csv", "--output", tmp_path / "both.csv", other, *at)
        assert both.code == 2 and "format_beside" in both.out + both.err and not (tmp_path / "both.csv").exists()


def test_a_date_means_the_whole_day(place: Warehouse) -> None:
    at = ("history", "--vessel", "mariner", "--warehouse", place.uri, "--json")
    today = datetime.now(UTC).date()
    assert len(kempf(*at, "--as-of", today.isoformat()).json) == 6
    assert kempf(*at, "--as-of", (today - timedelta(days=1)).isoformat()).json == []
    assert kempf(*at, "--as-of", f"{today.isoformat()}T00:00").json == []


def test_the_notebook_runs_on_the_tables(written: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("TABLES", str(written))
    monkeypatch.setenv("MPLBACKEND", "agg")
    notebook = json.loads((ROOT / "docs" / "notebooks" / "fleet.ipynb").read_text(encoding="utf-8"))
    names: dict[str, object] = {}
    shown = []
    for cell in notebook["cells"]:
        if cell["cell_type"] == "code":
            assert cell["outputs"] == []
            *before, last = ast.parse("".join(cell["source"])).body
            exec(compile(ast.Module(before, []), "cell", "exec"), names)  # noqa: S102 - the notebook is ours
            if isinstance(last, ast.Expr):
                found = eval(compile(ast.Expression(last.value), "cell", "eval"), names)  # noqa: S307
                shown += [found] if isinstance(found, pl.DataFrame) else []
            else:
                exec(compile(ast.Module([last], []), "cell", "exec"), names)  # noqa: S102
    models, sailed, _, nights = shown
    assert models["vessel"].to_list() == ["mariner"] and models["parameters"].to_list() == [6]
    assert sailed["vessel"].to_list() == ["mariner"] and nights["new_sets"].sum() == 2
