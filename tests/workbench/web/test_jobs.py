"""Jobs: asked for once, done by a process of their own, cancelled, begun anew where that dies, refused to strangers."""

from __future__ import annotations

import os
import signal
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from kempf.schemas.errors import KempfError, NotFound, UsageError
from kempf.workbench.web.jobs.engine_supervisor import EngineSupervisor
from kempf.workbench.web.jobs.queue import DONE, FAILED, MOST_WAITING, QUEUED, RUNNING, Queue, Tick
from tests.workbench.driving import kempf, tree
from tests.workbench.web.conftest import OURS, TOKEN, until


@pytest.fixture
def queue(tmp_path: Path) -> Queue:
    return Queue(tmp_path / "state" / "jobs.sqlite")


def test_the_same_request_is_the_same_job(queue: Queue):
    first = queue.ask("undo", {"vessel": "a"}, "state")
    assert queue.ask("undo", {"vessel": "a"}, "state") == first
    assert queue.ask("undo", {"vessel": "a"}, "another state").id != first.id
    assert [job.id for job in queue.all()][-1] == first.id


def test_what_was_changed_back_since_is_done_again(queue: Queue):
    name = queue.ask("undo", {"vessel": "a"}, "state", again=True).id
    queue.take()
    assert queue.ask("undo", {"vessel": "a"}, "state", again=True).state == RUNNING  # a second click
    queue.finish(name, {})
    assert queue.ask("undo", {"vessel": "a"}, "state").state == DONE
    assert queue.ask("undo", {"vessel": "a"}, "state", again=True).state == QUEUED


def test_jobs_are_taken_in_order_and_end_once(queue: Queue):
    asked = [queue.ask("undo", {"vessel": name}, "") for name in "ab"]
    first = queue.take()
    assert first is not None and (first.id, first.state, first.attempts) == (asked[0].id, RUNNING, 1)
    queue.tick(first.id, [Tick(0, 0, 2, "reading")])
    queue.tick(first.id, [Tick(0, 1, 2, "fitting")])
    assert [(t.number, t.what) for t in queue.ticks(first.id)] == [(1, "reading"), (2, "fitting")]
    assert [t.number for t in queue.ticks(first.id, after=1)] == [2]
    queue.finish(first.id, {"to": "/"})
    queue.fail(first.id, KempfError("late", "too late", "nothing"))
    assert queue.get(first.id).state == DONE and queue.get(first.id).result == {"to": "/"}
    second = queue.take()
    assert second is not None and second.id == asked[1].id and queue.take() is None


def test_a_job_whose_process_dies_is_begun_once_more(queue: Queue):
    name = queue.ask("undo", {"vessel": "a"}, "").id
    queue.take()
    queue.died(name)
    assert queue.get(name).state == QUEUED
    queue.take()
    queue.died(name)
    job = queue.get(name)
    assert job.state == FAILED and job.error is not None and job.error["code"] == "job_lost"
    assert queue.ask("undo", {"vessel": "a"}, "").state == QUEUED  # asked for again, it is begun anew


def test_what_cannot_be_asked_or_cancelled_says_so(queue: Queue):
    with pytest.raises(NotFound):
        queue.get("job-0")
    for k in range(MOST_WAITING):
        queue.ask("undo", {"vessel": str(k)}, "")
    with pytest.raises(KempfError, match="wait already"):
        queue.ask("undo", {"vessel": "one more"}, "")
    name = queue.all()[0].id
    queue.cancel(name)
    with pytest.raises(UsageError, match="cancelled"):
        queue.cancel(name)


def test_only_a_page_of_ours_in_the_browser_of_one_who_may_writes(client: TestClient):
    form = {"kind": "diagnose", "vessel": "mariner"}
    assert client.post("/jobs", data=form).status_code == 403  # no origin
    assert client.post("/jobs", data=form, headers={"origin": "http://evil.example"}).status_code == 403
    assert client.post("/jobs", data=form, headers={"origin": "null"}).status_code == 403
    refused = client.post("/jobs", data=form, headers=OURS)
    assert refused.status_code == 403 and "may only read" in refused.text
    assert client.get("/?token=wrong").headers.get("set-cookie") is None
    given = client.get(f"/v/mariner?token={TOKEN}&x=1")
    assert (given.status_code, given.headers["location"]) == (303, "/v/mariner?x=1")
    assert "HttpOnly" in given.headers["set-cookie"] and "SameSite=strict" in given.headers["set-cookie"]
    assert client.get(f"http://127.0.0.1//evil.example?token={TOKEN}").headers["location"] == "/evil.example"
    cross = {**OURS, "sec-fetch-site": "cross-site"}
    assert client.post("/jobs", data=form, headers=cross).status_code == 403
    assert client.post("/jobs", data=form, headers=OURS).status_code == 303


@pytest.mark.parametrize(
    ("form", "status", "code"),
    [
        ({"kind": "format", "vessel": "mariner"}, 400, "job_unknown"),
        ({}, 400, "job_unknown"),
        ({"kind": "diagnose", "vessel": "nobody"}, 404, "no_vessel"),
        ({"kind": "add", "vessel": "mariner", "effect": "nothing"}, 404, "effect_unknown"),
        ({"kind": "predict", "vessel": "mariner", "set": "ps-nothing", "horizon": "free"}, 404, "no_parameter_set"),
        ({"kind": "predict", "vessel": "mariner", "set": "", "horizon": "soon"}, 400, "horizon_unknown"),
        ({"kind": "undo", "vessel": "mariner", "standing": "ps-1234"}, 409, "moved_meanwhile"),
        ({"kind": "undo", "vessel": "v" * 20_000}, 400, "form_too_long"),
    ],
)
def test_a_form_that_cannot_be_done_says_why(writing: TestClient, form: dict[str, str], status: int, code: str):
    answer = writing.post("/jobs", data=form, headers=OURS)
    assert answer.status_code == status
    assert code in answer.text and "<strong>" in answer.text


def test_a_prediction_is_made_once_and_shown_as_the_command_prints_it(
    working: tuple[TestClient, EngineSupervisor, Queue], own: Path
):
    client, supervisor, queue = working
    assert "not made yet" in client.get("/v/mariner/model").text
    before = tree(own)
    form = {"kind": "predict", "vessel": "mariner", "set": "", "horizon": "free"}
    # two tabs ask, and a third while it runs
    places = {client.post("/jobs", data=form, headers=OURS).headers["location"] for _ in range(2)}
    assert len(places) == 1
    (place,) = places
    until(lambda: queue.get(place.rpartition("/")[2]).state == RUNNING)
    # the engine dies in the middle: another begins the job anew
    assert supervisor.process is not None and supervisor.process.pid is not None
    os.kill(supervisor.process.pid, signal.SIGKILL)
    until(lambda: client.get(place + ".json").json()["state"] == DONE)
    job = client.get(place + ".json").json()
    assert job["attempts"] in (1, 2) and [tick["what"] for tick in job["ticks"]][-1] == "predicted"
    assert tree(own) == before
    shown = client.get(job["result"]["to"])
    assert shown.status_code == 200 and len(shown.content) < 100_000
    printed = kempf("compare", "--vessel", "mariner", "--where", "--warehouse", own, "--json").json
    twin = client.get(job["result"]["to"].replace("/model?", "/model.json?")).json()
    assert {**twin, "alias": None} == {**printed, "alias": None}
    assert client.post("/jobs", data=form, headers=OURS).headers["location"] == place  # done already
    run = printed["runs"][0]["segment_id"]
    assert run in client.get(f"/v/mariner/model?run={run}").text
    assert client.get("/v/mariner/model?run=seg-0").status_code == 404


def test_a_job_that_is_cancelled_ends_and_leaves_nothing(
    working: tuple[TestClient, EngineSupervisor, Queue], own: Path
):
    client, _, queue = working
    place = client.post("/jobs", data={"kind": "diagnose", "vessel": "mariner"}, headers=OURS).headers["location"]
    name = place.rpartition("/")[2]
    until(lambda: queue.ticks(name))
    assert client.post(place + "/cancel", headers=OURS).status_code == 303
    assert "Run it again" in client.get(place).text
    assert client.post(place + "/cancel", headers=OURS).status_code == 409
    # the next one is done: the one before no longer holds the engine
    after = client.post("/jobs", data={"kind": "undo", "vessel": "mariner"}, headers=OURS).headers["location"]
    until(lambda: client.get(after + ".json").json()["state"] == FAILED)
    assert "nothing to undo" in client.get(after).text.lower()
    assert kempf("verify", "--warehouse", own).code == 0
