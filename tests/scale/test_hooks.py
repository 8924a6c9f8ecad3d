"""What real runs say to the world outside: figures for Prometheus, OpenLineage events to a server that takes them."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from shutil import copytree
from typing import Any

import pytest
from prometheus_client.parser import text_string_to_metric_families

from kempf.schemas.errors import DataRejected
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs
from tests.scale.conftest import FLEET, touch
from tests.scale.servers import free_port, received_text, receiver

pytestmark = pytest.mark.usefixtures("on_server")


@pytest.fixture
def place(stocked: Path, tmp_path: Path) -> Warehouse:
    return Warehouse(str(copytree(stocked, tmp_path / "w")))


def figures(text: str) -> dict[tuple[str, tuple[str, ...]], float]:
    """Every sample by its name and the values of its labels but the flow."""
    return {
        (one.name, tuple(value for label, value in sorted(one.labels.items()) if label != "flow")): one.value
        for family in text_string_to_metric_families(text)
        for one in family.samples
    }


def damage(place: Warehouse, vessel: str) -> None:
    (row,) = logs.current(place, vessel)
    assert place.folder is not None
    (place.folder / "raw" / row.log_id[:2] / row.log_id).write_bytes(b"damaged")


def test_the_figures_of_a_run_are_left_for_the_collector(
    place: Warehouse, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    from kempf.flows.fleet.flows import reprocess

    monkeypatch.setenv("KEMPF_METRICS_TEXTFILE", str(tmp_path))
    touch(place, *FLEET[:2])
    damage(place, FLEET[1])
    with pytest.raises(DataRejected):
        reprocess(place.uri, list(FLEET))
    text = (tmp_path / "kempf_reprocess.prom").read_text()
    found = figures(text)
    assert 'flow="reprocess"' in text
    assert found["kempf_run_succeeded", ()] == 0.0
    assert found["kempf_run_vessels", ("changed",)] + found.get(("kempf_run_vessels", ("unchanged",)), 0.0) == 2.0
    assert found["kempf_run_vessels", ("failed",)] == 1.0
    assert found["kempf_run_failures", ("raw_bytes_damaged",)] >= 1.0
    assert found["kempf_run_new_parameter_sets", ()] >= 1.0
    assert 0.0 < found["kempf_run_duration_seconds", ()] < found["kempf_run_end_timestamp_seconds", ()]
    assert reprocess(place.uri, [FLEET[0]])[0]["status"] == "unchanged"
    again = figures((tmp_path / "kempf_reprocess.prom").read_text())
    assert again["kempf_run_succeeded", ()] == 1.0 and ("kempf_run_vessels", ("failed",)) not in again
    # nothing half written is left beside it
    assert [path.name for path in tmp_path.glob("*.prom*")] == ["kempf_reprocess.prom"]


def test_the_figures_of_a_run_are_pushed(place: Warehouse, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from kempf.flows.fleet.flows import ingest

    (tmp_path / "minutes.pdf").write_bytes(b"%PDF-1.4 no log at all")
    with received_text() as (url, received):
        monkeypatch.setenv("KEMPF_METRICS_PUSHGATEWAY", url)
        with pytest.raises(DataRejected):
            ingest([str(tmp_path / "minutes.pdf")], place.uri, FLEET[0])
    ((path, text),) = received
    assert path == "/metrics/job/kempf/flow/ingest"
    assert figures(text)["kempf_run_logs", ("failed",)] == 1.0


@pytest.fixture
def stated(monkeypatch: pytest.MonkeyPatch) -> Iterator[list[dict[str, Any]]]:
    with receiver() as (url, received):
        monkeypatch.setenv("OPENLINEAGE_URL", url.rsplit("/", 1)[0])
        yield received


def test_a_run_says_what_it_read_and_wrote(place: Warehouse, stated: list[dict[str, Any]]) -> None:
    from kempf.flows.fleet.flows import reprocess

    touch(place, FLEET[0])
    before = delta.versions(place)
    reprocess(place.uri, list(FLEET))
    start, complete = stated
    assert (start["eventType"], complete["eventType"]) == ("START", "COMPLETE")
    assert start["run"]["runId"] == complete["run"]["runId"]
    assert start["job"] == complete["job"] and (start["job"]["namespace"], start["job"]["name"]) == (
        "kempf",
        "reprocess",
    )
    assert start["eventTime"] < complete["eventTime"]
    read = {one["name"]: one for one in start["inputs"]}
    assert {one["namespace"] for one in start["inputs"] + complete["outputs"]} == {"file"}
    at_start = read[f"{place.folder}/vessels"]["facets"]["version"]["datasetVersion"]
    assert at_start == str(before["vessels"])
    made = next(one for one in complete["outputs"] if one["name"] == f"{place.folder}/parameter_sets")
    assert int(made["facets"]["version"]["datasetVersion"]) == delta.versions(place)["parameter_sets"]
    assert delta.versions(place)["parameter_sets"] > before["parameter_sets"]


def test_a_run_that_failed_says_why(place: Warehouse, stated: list[dict[str, Any]]) -> None:
    from kempf.flows.fleet.flows import reprocess

    touch(place, FLEET[0])
    damage(place, FLEET[0])
    with pytest.raises(DataRejected):
        reprocess(place.uri, [FLEET[0]])
    assert [one["eventType"] for one in stated] == ["START", "FAIL"]
    assert FLEET[0] in stated[1]["run"]["facets"]["errorMessage"]["message"]


def test_nobody_who_listens_fails_no_run(place: Warehouse, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    from kempf.flows.fleet import lineage, metrics
    from kempf.flows.fleet.flows import reprocess

    nobody = f"http://127.0.0.1:{free_port()}"
    monkeypatch.setenv("OPENLINEAGE_URL", nobody)
    monkeypatch.setenv("KEMPF_METRICS_PUSHGATEWAY", nobody)
    monkeypatch.setenv("KEMPF_METRICS_TEXTFILE", str(tmp_path / "no folder"))
    assert [one["status"] for one in reprocess(place.uri, [FLEET[0]])] == ["unchanged"]
    registry = metrics.registry_of("reprocess", end_s=1.0, duration_s=1.0, succeeded=True, found=[])
    written, pushed = metrics.publish("reprocess", registry)
    assert "could not be written" in written and nobody in pushed
    event = lineage.Event("START", "reprocess", "0198c5a0-0000-7000-8000-000000000000", {"warehouse": place.uri})
    (sent,) = lineage.emit(event)
    assert nobody in sent and "START" in sent
