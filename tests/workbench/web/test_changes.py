"""Whether a vessel changed, in the workbench beside the command line; and what was known at an earlier time."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from datetime import UTC, datetime
from pathlib import Path

import numpy as np
import pytest
from starlette.testclient import TestClient

from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import notes, vessels
from kempf.workbench.web.draw.history import draw_history
from kempf.workbench.web.jobs.engine_supervisor import EngineSupervisor
from tests.history.made import step
from tests.workbench.driving import kempf
from tests.workbench.test_history_changes import VESSEL, made_sets, put
from tests.workbench.web.conftest import OURS, TOKEN, client_of, until

PAGE = f"/v/{VESSEL}/changes"
Open = Callable[[int, np.ndarray | None], TestClient]


@contextmanager
def at_work(place: Path, state: Path) -> Iterator[TestClient]:
    """A browser that may write, and an engine at work."""
    supervisor = EngineSupervisor(state, Warehouse(str(place)))
    supervisor.start()
    try:
        with client_of(place, state) as client:
            client.get(f"/?token={TOKEN}")
            yield client
    finally:
        supervisor.stop()


@pytest.fixture
def opened(tmp_path: Path) -> Iterator[Open]:
    """The pages of a vessel with so many sets."""
    with ExitStack() as stack:

        def with_sets(n: int, shift: np.ndarray | None = None) -> TestClient:
            place = tmp_path / "w"
            vessels.register(Warehouse(str(place)), VESSEL, VesselProfile())
            put(place, *made_sets(n, shift))
            one: AbstractContextManager[TestClient] = at_work(place, tmp_path / "state")
            return stack.enter_context(one)

        yield with_sets


def looked_for(client: TestClient, as_of: str = "") -> None:
    form = {"kind": "changes", "vessel": VESSEL, "as_of": as_of}
    job = client.post("/jobs", data=form, headers=OURS).headers["location"] + ".json"
    until(lambda: client.get(job).json()["state"] == "done")
    assert client.get(job).json()["result"]["to"].startswith(PAGE)


def test_a_new_rudder_is_a_band_and_what_the_command_prints(opened: Open, tmp_path: Path) -> None:
    client, place = opened(16, step(16, 9, b1=0.1, b2=0.1)), tmp_path / "w"
    docked_ns = made_sets(16)[9].start_utc_ns - 86_400_000_000_000
    notes.add(Warehouse(str(place)), VESSEL, "vessel", VESSEL, "docked & <b>painted</b>", event_utc_ns=docked_ns)
    before = client.get(PAGE).text
    assert "Look for changes" in before and "changed moved" not in before and client.get(PAGE + ".json").json() is None
    looked_for(client)
    page = client.get(PAGE)
    assert page.status_code == 200 and len(page.content) < 100_000
    assert (
        client.get(PAGE + ".json").json()
        == kempf("history", "--vessel", VESSEL, "--changes", "--warehouse", place, "--json").json
    )
    # the rudder's two parameters moved, and no other
    assert page.text.count('class="changed moved"') == 2 and page.text.count('class="changed"') == 4
    assert page.text.count(">yes</td>") == 2 and "What would be seen" in page.text
    assert "do not agree within their standard errors" in page.text
    assert ">note 1</text>" in page.text and "docked &amp; &lt;b&gt;painted&lt;/b&gt;" in page.text
    vessel_page = client.get(f"/v/{VESSEL}").text
    assert vessel_page.count('class="changed moved"') == 2 and "What changed" in vessel_page


def test_three_occasions_are_too_few_and_it_says_so(opened: Open) -> None:
    client = opened(3)
    looked_for(client)
    page = client.get(PAGE).text
    assert "Not testable with these data" in page and "at least 4 occasions are needed" in page
    assert "What would be seen" not in page and "changed" not in page.replace("What changed", "")


def test_what_was_known_then_is_what_the_command_says_of_then(opened: Open, tmp_path: Path) -> None:
    client, place = opened(8), tmp_path / "w"
    long_ago = client.get(PAGE + "?as_of=2001-02-03").text
    assert (
        "No parameter set of any vessel was stored by 2001-02-03 23:59:59 UTC" in long_ago
        and "<figure>" not in long_ago
    )
    then = datetime.now(UTC).isoformat().replace("+00:00", "Z")
    put(place, *made_sets(16)[8:])
    looked_for(client, then)
    of_then = client.get(PAGE + ".json", params={"as_of": then}).json()
    asked = ("history", "--vessel", VESSEL, "--changes", "--warehouse", place, "--json")
    assert of_then == kempf(*asked, "--as-of", then).json and len(of_then["history"]) == 8 * 6
    assert len(kempf(*asked).json["history"]) > len(of_then["history"])
    at_ns = made_sets(16)[4].start_utc_ns
    notes.add(Warehouse(str(place)), VESSEL, "vessel", VESSEL, "docked, said later", event_utc_ns=at_ns)
    of_then_page = client.get(PAGE, params={"as_of": then}).text
    assert "as known now" in of_then_page and "docked, said later" not in of_then_page
    assert "docked, said later" in client.get(PAGE).text


def test_a_model_of_two_versions_is_drawn_by_the_tests_of_one() -> None:
    """A step that the sets of either version show is one step."""
    rows = [
        {
            **{"parameter": "b2", "value": 1.0 + k, "low": 0.5 + k, "high": 1.5 + k, "unit": "1", "superseded": False},
            **{"converged": True, "model": "linear", "estimator": "ml", "start_utc_ns": k * 10**18},
            **{"start": f"20{10 + k}-01-01T00:00:00Z", "parameter_set_id": f"ps-{k}"},
        }
        for k in range(2)
    ]
    moved = {"b2": {"moved": True, "percent": 9.0, "percent_std": 1.0}}
    step_found = {"kind": "step", "between": ["1980-01-01T00:00:00Z", "1990-01-01T00:00:00Z"], "parameters": moved}
    both = [{"model": "linear", "estimator": "ml", "sets": n, "changes": [step_found]} for n in (8, 9)]
    drawn = str(draw_history(rows, both))
    assert drawn.count("changed moved") == 1 and drawn.count("step +9.0") == 1


def test_a_time_that_is_none_is_a_page_in_words(opened: Open) -> None:
    client = opened(3)
    page = client.get(PAGE + "?as_of=yesterday")
    assert page.status_code == 400 and "is no time; expected ISO 8601" in page.text and "Traceback" not in page.text
