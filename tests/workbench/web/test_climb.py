"""How a fit goes, on the page of its job: drawn by the server, drawn on by the script, the same after a reload."""

from __future__ import annotations

import re
import sqlite3
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from kempf.flows.process.progress import Figures
from kempf.workbench.web.jobs.job_progress import JobProgress
from kempf.workbench.web.jobs.queue import FAILED, RUNNING, Queue, Tick
from tests.workbench.web.browsing import NEEDS_BROWSER, Server, opened
from tests.workbench.web.conftest import until

#: two models: the plain one and one with an effect, which begins lower than the first has come to
CLIMB = [
    *(
        "fitting the plain model",
        (1, 1, -500.0, 0.09),
        (2, 1, 900.0, 0.05),
        (3, 1, 1100.0, 0.045),
        (4, 2, 1100.5, 0.0449),
    ),
    *(
        "fitting rudder_lag",
        (5, 3, 1000.0, 0.046),
        (6, 3, 1200.0, None),
        (7, 3, 1234.52, 0.0314),
        (8, 4, 1234.52, 0.0314),
    ),
]
LAST = {4, 8}


def ticks(climb: list[Any]) -> list[Tick]:
    """What a job reports of it."""
    found, what = [], ""
    for one in climb:
        if isinstance(one, str):
            what = one
            found.append(Tick(0, 0, 3, what))
        else:
            found.append(Tick(0, 0, 3, what, Figures(*one, fitted=one[0] in LAST)))
    return found


def running(queue: Queue) -> str:
    """A job that runs though no engine has it."""
    with closing(sqlite3.connect(queue.path)) as file, file:
        file.execute(
            "INSERT INTO jobs (id, number, kind, arguments, state, attempts) VALUES (?, 9, 'add', ?, ?, 1)",
            ("job-0123456789abcdef", '{"vessel": "mariner", "effect": "rudder_lag"}', RUNNING),
        )
    return "job-0123456789abcdef"


@pytest.fixture
def queue(tmp_path: Path) -> Queue:
    return Queue(tmp_path / "state" / "jobs.sqlite")


def test_the_page_of_a_job_shows_how_its_fit_goes(queue: Queue, client: TestClient):
    name = running(queue)
    queue.tick(name, ticks(["reading the logs"]))
    page = client.get(f"/jobs/{name}").text
    assert re.search(r'id="climb"[^>]* hidden', page) and page.count("<li>") == 1
    queue.tick(name, ticks(CLIMB))
    page = client.get(f"/jobs/{name}").text
    assert not re.search(r'id="climb"[^>]* hidden', page)
    assert "Iteration 8: log-likelihood 1234.5, error one step ahead 3.14 % (9 % at iteration 1)." in page
    assert page.count("<li>") == 3  # pieces of work, not iterations
    lines = re.findall(r'<path d="([^"]*)" fill="none" class="line-climb">', page)
    assert [line.count("M") for line in lines] == [2, 2] and [line.count("L") for line in lines] == [4, 3]
    assert [dots.count("M") for dots in re.findall(r'd="([^"]*)" fill="none" class="line-fitted"', page)] == [2, 2]
    assert page.count("<tr data-climb=") == 8
    stated = client.get(f"/jobs/{name}.json?after=9").json()["ticks"]
    assert [tick["figures"]["iteration"] for tick in stated] == [7, 8]
    assert stated[1]["figures"] == {
        **{"iteration": 8, "climb": 4, "log_likelihood": 1234.52, "error": 0.0314, "fitted": True}
    }
    for no_number in ("²", "-1", "9" * 5000):
        every = client.get(f"/jobs/{name}.json", params={"after": no_number})
        assert every.status_code == 200 and len(every.json()["ticks"]) > 2
    queue.finish(name, {"to": "/"})
    assert "Iteration 8" in client.get(f"/jobs/{name}").text  # it stays when the job is done


def test_a_long_climb_keeps_the_page_small(queue: Queue, client: TestClient):
    name = running(queue)
    queue.tick(name, ticks(["fitting the plain model", *((k, 1, -1e5 / k, 0.1 / k) for k in range(1, 2000))]))
    page = client.get(f"/jobs/{name}").text
    assert page.count("<tr data-climb=") == 200 and len(page) < 100_000


def test_a_queue_of_an_older_version_keeps_its_jobs_and_begins_its_ticks_anew(tmp_path: Path):
    path = tmp_path / "jobs.sqlite"
    name = running(Queue(path))
    with closing(sqlite3.connect(path)) as file, file:
        file.execute("DROP TABLE ticks")
        file.execute("CREATE TABLE ticks (job TEXT, number INTEGER, done INTEGER, total INTEGER, what TEXT)")
        file.execute("INSERT INTO ticks VALUES (?, 1, 0, 1, 'reading')", (name,))
    queue = Queue(path)
    assert queue.get(name).state == RUNNING and queue.ticks(name) == []
    queue.tick(name, ticks(CLIMB))
    assert Queue(path).ticks(name) == queue.ticks(name) and len(queue.ticks(name)) == 10


def test_quick_iterations_are_written_together_and_none_is_lost(queue: Queue):
    name, written = running(queue), []
    tick = queue.tick
    queue.tick = lambda name, ticks: (written.append(len(ticks)), tick(name, ticks))[1]  # type: ignore[method-assign]
    progress = JobProgress(queue, name)
    progress(0, 2, "fitting the plain model")
    for k in range(1, 101):
        progress.iterated(0, 2, "fitting the plain model", Figures(k, 1, float(k), None))
    progress(1, 2, "predicting one leg ahead")
    progress.write()
    found = queue.ticks(name)
    assert [one.number for one in found] == list(range(1, 103)) and len(written) < 50
    assert [one.figures.iteration for one in found if one.figures] == list(range(1, 101))


@NEEDS_BROWSER
def test_the_curve_grows_while_the_job_runs_and_is_the_same_after_a_reload(
    browser: Any,
    server: Server,
    queue: Queue,
):
    # an engine that begins puts jobs that seem to run back into the queue: it is to have begun
    first = queue.ask("undo", {"vessel": "nobody"}, "").id
    until(lambda: queue.get(first).state == FAILED)
    name, drawn = running(queue), "Array.from(document.querySelectorAll('#climb path, #climb text'), one => "
    drawn += "one.getAttribute('d') || one.textContent)"
    queue.tick(name, ticks(["reading the logs"]))
    tab = opened(browser, server)
    tab.goto(f"{server.base}/jobs/{name}")
    assert not tab.is_visible("#climb")
    queue.tick(name, ticks(CLIMB[:4]))
    tab.wait_for_selector("#iterations tr:nth-child(3)", state="attached")
    assert tab.is_visible("#climb") and "Iteration 3" in tab.inner_text("#sentence")
    queue.tick(name, ticks(CLIMB)[4:])
    tab.wait_for_selector("#iterations tr:nth-child(8)", state="attached")
    assert "log-likelihood 1234.5, error one step ahead 3.14 %" in tab.inner_text("#sentence")
    assert tab.inner_text("#now") == "fitting rudder_lag"
    by_script = tab.evaluate(drawn)
    tab.reload()
    assert tab.evaluate(drawn) == by_script and len(tab.query_selector_all("#iterations tr")) == 8
    assert "3.14 %" in tab.inner_text("#sentence")
    queue.finish(name, {"to": "/effects"})
    tab.wait_for_url("**/effects")
    assert server.complaints == []
