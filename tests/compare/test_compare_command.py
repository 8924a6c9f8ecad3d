"""``kempf compare`` and its call from a notebook, on a warehouse of a simulated ship."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from shutil import copytree

import pytest

from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, parameter_sets, segments
from kempf.warehouse.tables.parameter_set import ParameterSet
from kempf.workbench.notebook.warehouse_view import open_warehouse
from kempf.workbench.terminal import WIDEST
from tests.conftest import Ship
from tests.workbench.driving import kempf, refused, tree

CHANNELS = ["yaw_rate", "heading", "lateral_speed"]
#: the keys that people script against
PROMISED = {"segment_id", "held_out", "fit_percent", "rms", "overshoot_error_deg"}


@pytest.fixture(scope="module")
def _place(mariner: Ship, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A warehouse with one manoeuvre in two logs, identified by maximum likelihood from both."""
    folder = tmp_path_factory.mktemp("compare")
    logs = mariner.write(folder / "logs")
    paths = [logs / "mariner.nmea.gz", logs / "mariner.csv.gz"]
    done = kempf("ingest", *paths, "--profile", logs / "profile.yaml", "--warehouse", folder / "w")
    assert done.code == 0, done
    done = kempf("identify", "--vessel", "mariner", "--warehouse", folder / "w")
    assert done.code == 0, done
    return folder / "w"


@pytest.fixture
def place(_place: Path) -> Iterator[Path]:
    before = tree(_place)
    yield _place
    assert tree(_place) == before, "comparing stores nothing"


@pytest.fixture
def own(_place: Path, tmp_path: Path) -> Path:
    return copytree(_place, tmp_path / "own")


def asked(place: Path, *more: object) -> dict:
    done = kempf("compare", "--vessel", "mariner", *more, "--warehouse", place, "--json")
    assert done.code == 0, done
    return done.json


def elsewhere(place: Path) -> ParameterSet:
    """The same parameters as a set that was identified from another log, and stored."""
    warehouse = Warehouse(str(place))
    known = parameter_sets.get(warehouse, aliases.of_vessel(warehouse, "mariner")["current"])
    inputs = {**known.provenance["inputs"], "segments": [{"log_id": "0" * 64, "start_utc_ns": 0, "end_utc_ns": 1}]}
    made = replace(
        known,
        parameter_set_id="ps-0123456789abcdef",
        segment_ids=("seg-0123456789abcdef",),
        provenance={**known.provenance, "inputs": inputs},
    )
    parameter_sets.insert(warehouse, [made])
    return made


@pytest.fixture(scope="module")
def document(_place: Path) -> dict:
    """The free run under the default set."""
    return asked(_place)


def test_one_document_with_the_promised_keys(place: Path, document: dict) -> None:
    assert {"vessel", "parameter_set_id", "horizon", "runs"} <= set(document)
    assert (document["vessel"], document["horizon"], document["horizon_words"]) == ("mariner", "free", "free run")
    assert document["alias"] == "current"
    (run,) = document["runs"]
    assert set(run) >= PROMISED
    assert list(run["fit_percent"]) == CHANNELS and list(run["rms"]) == CHANNELS
    assert all(80.0 < fit <= 100.0 for fit in run["fit_percent"].values()), run["fit_percent"]
    found = {s.segment_id: s for s in segments.current(Warehouse(str(place)))}[run["segment_id"]]
    assert len(run["overshoot_error_deg"]) == len(found.overshoots_deg)
    measured = [turn["measured_deg"] for turn in run["overshoots"]]
    assert measured == pytest.approx(list(found.overshoots_deg))
    assert all(abs(e) < 3.0 for e in run["overshoot_error_deg"])
    assert "wind_force_m_s2" in run["started_from"]["disturbances"]


def test_a_manoeuvre_that_another_log_holds_too_is_not_held_out(place: Path, document: dict) -> None:
    known = parameter_sets.summaries(Warehouse(str(place)), "mariner")["parameter_set_id"].to_list()
    other = next(one for one in known if one != document["parameter_set_id"])
    for one in (document, asked(place, "--set", other)):
        assert [run["held_out"] for run in one["runs"]] == [False]
        assert one["summary"]["held_out"] is None
        assert one["judged"]["sample"] == "fitted"
        # the other log's segment is listed as left out
        assert len(one["skipped"]) == 1


def test_a_set_from_elsewhere_is_put_to_a_held_out_run(own: Path) -> None:
    made = elsewhere(own)
    document = asked(own, "--set", made.parameter_set_id, "--horizon", "10s")
    assert [run["sample"] for run in document["runs"]] == ["held_out"]
    assert document["summary"]["fitted"] is None
    assert document["summary"]["held_out"]["runs"] == 1
    inside = document["runs"][0]["inside_95_percent"]
    assert list(inside) == CHANNELS
    assert all(one["share"] == one["inside"] / one["of"] for one in inside.values())
    assert all(0.8 < one["share"] <= 1.0 for one in inside.values()), inside
    assert document["runs"][0]["noise_levels"].startswith("fitted to this manoeuvre")


def test_runs_that_a_model_held_out_stay_held_out(own: Path, document: dict) -> None:
    warehouse = Warehouse(str(own))
    known = parameter_sets.get(warehouse, document["parameter_set_id"])
    (name,) = known.segment_ids
    held = {**known.convergence, "held_out": [name]}
    settings = {**known.settings, "segments": [name]}
    made = replace(known, parameter_set_id="ps-00000000000000bb", convergence=held, settings=settings)
    parameter_sets.insert(warehouse, [made])
    assert [run["held_out"] for run in asked(own, "--set", made.parameter_set_id)["runs"]] == [True]


def test_where_it_fails_is_shown_by_sample(place: Path) -> None:
    document = asked(place, "--where")
    assert document["where"]["held_out"] is None
    found = document["where"]["fitted"]
    assert {"by_phase", "by_side", "by_bin", "by_run", "by_band", "correlations", "worst"} <= set(found)
    assert {"approach", "execute", "overshoot", "counter_rudder"} <= set(found["by_phase"])
    output = kempf("compare", "--vessel", "mariner", "--where", "--horizon", "1", "--warehouse", place)
    assert output.code == 0
    assert "horizon: one step" in output.out
    assert "fitted: 1 manoeuvre" in output.out and "held out: no manoeuvre" in output.out
    assert "where it fails, fitted manoeuvres" in output.out and "worst windows" in output.out


def test_a_manoeuvre_is_one_line_of_the_table_and_all_overshoots_are_verbose(place: Path, document: dict) -> None:
    short = document["runs"][0]["segment_id"][:12]
    errors = [f"{error:+.2f}" for error in document["runs"][0]["overshoot_error_deg"]]
    for more, lines in (((), 1), (("--verbose",), 2)):
        done = kempf("compare", "--vessel", "mariner", *more, "--warehouse", place)
        shown = [line for line in done.out.splitlines() if short in line]
        assert len(shown) == lines and all(len(line) <= WIDEST for line in shown), done.out
        assert shown[0].split()[-1] == max(errors, key=lambda error: abs(float(error)))
        assert [" ".join(errors) in line for line in shown[1:]] == [True] * (lines - 1)


def test_a_threshold_that_is_exceeded_is_an_exit_code(place: Path, document: dict) -> None:
    error = document["judged"]["free_run_error_percent"]
    for limit, code in ((error + 1.0, 0), (error - 1.0, 5)):
        done = kempf("compare", "--vessel", "mariner", "--fail-above", limit, "--warehouse", place, "--json")
        assert done.code == code, done
        assert done.json["fail_above"]["exceeded"] is (code == 5)
        assert done.json["fail_above"]["limit_percent"] == limit
        assert ("fitted manoeuvres" in done.err) is (code == 5)


def test_several_sets_are_all_compared(own: Path, document: dict) -> None:
    first, second = document["parameter_set_id"], elsewhere(own).parameter_set_id
    both = asked(own, "--set", first, "--set", second, "--set", first)
    assert [one["parameter_set_id"] for one in both] == [first, second]
    assert both[0] == asked(own, "--set", first), "one alone keeps its form"
    output = kempf("compare", "--vessel", "mariner", "--set", first, "--set", second, "--warehouse", own)
    assert first in output.out and second in output.out
    done = kempf(
        "compare", "--vessel", "mariner", "--set", first, "--set", second, "--fail-above", 0, "--warehouse", own
    )
    assert done.code == 5 and first in done.err and second in done.err


def test_the_default_is_the_current_set_and_an_alias_names_any_other(own: Path) -> None:
    warehouse, made = Warehouse(str(own)), elsewhere(own)
    before = aliases.of_vessel(warehouse, "mariner")["current"]
    done = kempf("params", "alias", "as-built", made.parameter_set_id, "--warehouse", own, "--json")
    assert done.json == {
        "vessel": "mariner",
        "alias": "as-built",
        "parameter_set_id": made.parameter_set_id,
        "before": None,
    }
    for more, alias, wanted in (((), "current", before), (("--set", "as-built"), "as-built", made.parameter_set_id)):
        document = asked(own, *more)
        assert (document["alias"], document["parameter_set_id"]) == (alias, wanted)
    assert kempf("params", "alias", "current", "as-built", "--warehouse", own).code == 0
    assert asked(own)["parameter_set_id"] == made.parameter_set_id


def test_a_wrong_request_is_refused_clearly(place: Path) -> None:
    wrong = [
        (("--horizon", "soon"), 2, "horizon_unknown"),
        (("--horizon", "1000s"), 3, "nothing_to_compare"),
        (("--set", "ps-ffff"), 4, "no_parameter_set"),
        (("--fail-above", "nan"), 2, "threshold"),
        (("--figure", "figure.gif"), 2, "figure_format"),
    ]
    for more, code, name in wrong:
        refused(kempf("compare", "--vessel", "mariner", *more, "--warehouse", place, "--json"), code, name)
    refused(kempf("compare", "--vessel", "nobody", "--warehouse", place, "--json"), 4, "no_vessel")


def test_a_set_without_values_is_refused(own: Path) -> None:
    made = elsewhere(own)
    lacking = replace(
        made, parameter_set_id="ps-00000000000000aa", parameters=made.parameters[:5], covariance=(), covariance_names=()
    )
    parameter_sets.insert(Warehouse(str(own)), [lacking])
    done = kempf("compare", "--vessel", "mariner", "--set", "ps-00000000000000aa", "--warehouse", own, "--json")
    assert refused(done, 3, "set_without_parameters")["details"]["lacking"] == [made.parameters[5].name]


def test_a_figure_and_the_view_of_a_notebook(place: Path, tmp_path: Path) -> None:
    done = kempf("compare", "--vessel", "mariner", "--figure", tmp_path / "f.png", "--warehouse", place)
    assert done.code == 0
    data = (tmp_path / "f.png").read_bytes()
    again = kempf("compare", "--vessel", "mariner", "--figure", tmp_path / "f.png", "--warehouse", place, "--json")
    refused(again, 2, "cannot_write")
    assert (tmp_path / "f.png").read_bytes() == data
    assert data.startswith(b"\x89PNG") and len(data) > 20_000
    view = open_warehouse(place).vessel("mariner").compare(horizon="10s")
    page = view._repr_html_()
    assert page == view._repr_html_()
    assert re.findall(r"(?:src|href)=\"(.{15})", page) == ["data:image/png;"]
    assert "10 s ahead" in page and "fitted" in page
    assert view.table["channel"].to_list() == CHANNELS
    assert view.table.columns == ["segment_id", "sample", "channel", "fit_percent", "rms", "unit", "n"]
    assert view.figure.axes
    assert view.where()["fitted"]["by_run"]
