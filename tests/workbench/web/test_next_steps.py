"""What a page says is to be done next, after a correction, an effect added, a job asked for."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from pathlib import Path
from shutil import copytree

import pytest
from starlette.testclient import TestClient

from kempf.flows.jobs.corrections.correct_segments import plan_for
from kempf.flows.jobs.identify import standing_model
from kempf.flows.process.progress import silent
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import aliases, segments
from kempf.workbench.web.jobs.kinds import KINDS, Work
from kempf.workbench.web.jobs.queue import Queue
from tests.late import VESSEL, some_effects
from tests.workbench.driving import kempf
from tests.workbench.web.conftest import OURS, TOKEN, client_of
from tests.workbench.web.test_forms import form_of

PAGE = f"/v/{VESSEL}"


@pytest.fixture
def late(late_added: Path, tmp_path: Path) -> Warehouse:
    """A ship whose rudder answers late, diagnosed, the lag in her model."""
    return Warehouse(str(copytree(late_added / "w", tmp_path / "w")))


@pytest.fixture
def client(late: Warehouse, tmp_path: Path) -> Iterator[TestClient]:
    """A browser that may write at her pages; no engine is at work."""
    with client_of(Path(late.uri), tmp_path / "state") as one:
        one.get(f"/?token={TOKEN}")
        yield one


def excluded(late: Warehouse) -> str:
    """Exclude a manoeuvre, and return the id of the set that was her current one."""
    current = aliases.of_vessel(late, VESSEL)[aliases.CURRENT]
    plan_for(late, segments.current(late, VESSEL)[0].segment_id, "exclude", "tugs alongside").store(late)
    return current


def test_where_a_model_was_withdrawn_every_page_offers_what_brings_it_back(late: Warehouse, client: TestClient):
    assert "Bring up to date" not in client.get(PAGE).text and "Bring up to date" not in client.get("/").text
    withdrawn = excluded(late)
    page = client.get(PAGE).text
    assert f"no parameter set is current, since what {withdrawn} rests on was corrected" in page
    assert 'value="reprocess"' in form_of(page, "Bring up to date")
    fleet = client.get("/").text
    assert "her models rest on manoeuvres that count no longer" in fleet and form_of(fleet, "Bring up to date")
    for place in ("model", "ladder", "predict", "what-if"):
        answer = client.get(f"{PAGE}/{place}")
        assert answer.status_code == 404 and 'value="reprocess"' in form_of(answer.text, "Bring up to date")
        assert f'<a href="{PAGE}">' in answer.text and "kempf reprocess" not in answer.text
    noted = kempf("params", "list", "--vessel", VESSEL, "--warehouse", late.uri)
    assert "no parameter set is current" in noted.err


def test_a_current_set_that_is_superseded_is_called_so(late: Warehouse, client: TestClient):
    current = excluded(late)
    aliases.point(late, VESSEL, current)
    for place in ("", "/ladder", "/predict", "/model"):
        page = client.get(PAGE + place).text
        assert f"the current parameter set {current} is superseded" in page and form_of(page, "Bring up to date")
    assert "is superseded" in kempf("ladder", "--vessel", VESSEL, "--warehouse", late.uri).err


def test_an_effect_that_is_in_her_model_is_neither_lacking_nor_added_again(
    late: Warehouse, client: TestClient, late_diagnosed: Path
):
    found = json.loads((late_diagnosed / "diagnosed.json").read_text())["diagnosis_id"]
    diagnosis = client.get(f"/diagnoses/{found}").text
    assert "What she lacked" in diagnosis and "Her current model has rudder lag" in diagnosis
    assert 'value="add"' not in diagnosis
    effect = client.get("/effects/rudder_lag").text
    assert "none by the newest diagnoses" in effect and f'<a href="{PAGE}">' in effect
    assert "rudder lag (a model with it is stored)" in client.get("/").text
    standing_model.undo(late, VESSEL)
    diagnosis = client.get(f"/diagnoses/{found}").text
    assert "What she lacks" in diagnosis and form_of(diagnosis, "Add rudder lag")
    assert "none by the newest diagnoses" not in client.get("/effects/rudder_lag").text


def test_a_job_is_found_from_every_page(client: TestClient):
    assert "Jobs (" not in client.get("/effects").text and "None runs or waits" in client.get("/jobs").text
    first, second = (
        client.post("/jobs", data={"kind": kind, "vessel": VESSEL}, headers=OURS).headers["location"]
        for kind in ("diagnose", "changes")
    )
    assert "Jobs (2)" in client.get("/effects").text
    listed = client.get("/jobs").text
    assert 0 < listed.index(first) < listed.index(second)
    assert f'<a href="{first}">it waits</a>' in client.get(PAGE).text
    assert "1 before it" in client.get(second).text and "before it" not in client.get(first).text
    client.post(first + "/cancel", headers=OURS)
    listed = client.get("/jobs").text
    assert listed.index(second) < listed.index("The last ones") < listed.index(first) and "cancelled" in listed


def test_a_ship_without_a_model_of_several_manoeuvres_is_offered_one(filled: Path, tmp_path: Path):
    with client_of(filled, tmp_path / "state") as one:
        one.get(f"/?token={TOKEN}")
        assert "/v/mariner/ladder" not in one.get("/v/mariner").text
        answer = one.get("/v/mariner/ladder")
    assert answer.status_code == 404 and 'value="diagnose"' in form_of(answer.text, "Diagnose")


def test_the_report_is_downloaded_as_the_command_writes_it(late_diagnosed: Path, tmp_path: Path):
    place, state = copytree(late_diagnosed / "w", tmp_path / "w"), tmp_path / "state"
    found = json.loads((late_diagnosed / "diagnosed.json").read_text())["diagnosis_id"]
    with client_of(place, state) as client:
        client.get(f"/?token={TOKEN}")
        form = form_of(client.get(f"/diagnoses/{found}").text, "Write the report")
        assert 'value="report"' in form_of(client.get(PAGE).text, "Write the report")
        fields = dict(re.findall(r'name="(\w+)" value="([^"]*)"', form))
        job = client.post("/jobs", data=fields, headers=OURS).headers["location"]
        assert client.get(job + "/report").status_code == 404
        queue, (asked,) = Queue(state / "jobs.sqlite"), Queue(state / "jobs.sqlite").active()
        queue.take()
        with some_effects():
            queue.finish(asked.id, KINDS["report"].do(Work(Warehouse(str(place)), state, asked.arguments, silent)))
            written = kempf("report", "--vessel", VESSEL, "--warehouse", place, "--output", tmp_path / "it.html")
        assert written.code == 0, written
        page = client.get(job).text
        assert f'href="{job}/report"' in page and f"/diagnoses/{found}" in page
        file = client.get(job + "/report")
        assert file.headers["content-disposition"] == f'attachment; filename="{VESSEL}.html"'
        assert file.content == (tmp_path / "it.html").read_bytes()
        next((state / "reports").iterdir()).unlink()
        assert "no_report" in client.get(job + "/report").text
        # asked for once more it is made anew
        assert client.post("/jobs", data=fields, headers=OURS).headers["location"] == job and queue.active()
