"""What the pages say: names instead of ids, units, what a word means, and no option of a command."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

import pytest
from markupsafe import Markup
from starlette.testclient import TestClient

import kempf
from kempf.workbench.documents.manoeuvres import logs_begin_alike
from kempf.workbench.web import wording
from kempf.workbench.web.draw.svg import drawing
from kempf.workbench.web.pages import compare, diagnosis
from kempf.workbench.web.pages.explain import sizes_of
from tests.workbench.web.test_pages import ids

#: Errors that no page can come to: of commands alone, or before the pages are served.
OF_COMMANDS = {"no_profile_given", "warehouse_path", "warehouse_layout", "not_a_warehouse"}


def test_no_error_on_a_page_asks_for_an_option():
    lacking = set()
    for room in ("flows", "pipeline", "warehouse"):
        for path in (Path(kempf.__path__[0]) / room).resolve().rglob("*.py"):
            for call in ast.walk(ast.parse(path.read_text())):
                if not (isinstance(call, ast.Call) and len(call.args) > 2 and isinstance(call.args[0], ast.Constant)):
                    continue
                code, next_step = str(call.args[0].value), re.sub(r"`[^`]*`", "", ast.unparse(call.args[2]))
                if re.search(r"--[a-z]", next_step):
                    shown = wording.next_step({"code": code, "next_step": next_step})
                    lacking |= {code} if "--" in shown else set()
    assert lacking <= OF_COMMANDS


def test_what_the_pages_call_an_effect_leads_to_it(client: TestClient):
    for typed in ("rudder lag", "Rudder_lag", "first-order rudder lag"):
        assert client.get("/go", params={"q": typed}).headers["location"] == "/effects/rudder_lag"


def test_a_vessel_has_units_in_her_profile_and_her_parameters_a_caption(client: TestClient):
    page = client.get("/v/mariner").text
    assert "<dt>length, m</dt>" in page and not re.search(r"<dt>[^<,]* (m|deg|m s|per m)</dt>", page)
    assert re.search(r"Dots: parameter sets of the model \w[^<]* 95 % intervals", page)
    assert '<th scope="col">in force</th>' in page and "<td>maximum likelihood</td>" in page
    assert "by when sets were stored, not sailed" in client.get("/v/mariner/changes").text
    assert "manoeuvres to fit" in client.get("/").text


def test_the_discrete_model_says_at_which_speed_and_step(client: TestClient):
    page = client.get(f"/sets/{ids(client)['set']}").text
    assert re.search(r"At [0-9.]+ m/s and a step of [0-9.]+ s\.", page)
    assert re.search(r'href="/segments/seg-[0-9a-f]+">\d+/\d+ zigzag to (starboard|port), 20\d\d-', page)


def test_two_sets_say_which_parameters_predictions_take_instead(client: TestClient, monkeypatch: pytest.MonkeyPatch):
    first, *_, second = (one["parameter_set_id"] for one in client.get("/v/mariner/sets.json").json())
    address = f"/compare?a={first}&b={second}"
    assert "fitted to legs" not in client.get(address).text
    monkeypatch.setattr(compare, "by_name", lambda one: {"a11": (0.0, 1.0)} if one.parameter_set_id == first else {})
    said = re.findall(
        r'Of <a href="/sets/([^"]*)">[^<]*</a> these are the parameters by likelihood', client.get(address).text
    )
    assert said == [first]


def candidate(effect: str, verdict: str, score: float, why: str) -> dict[str, Any]:
    return {"effect": effect, "title": effect, "verdict": verdict, "score": score, "absorption": 0.5, "why": why}


def test_a_diagnosis_calls_absent_only_what_was_not_seen(client: TestClient, monkeypatch: pytest.MonkeyPatch):
    content = {
        **{"diagnosis_id": "dx-1", "vessel": "mariner", "parameter_set_id": "ps-1", "sentences": [], "sets": []},
        "ladder": [{"step": 0, "added": None, "effects": {}}],
        "candidates": [
            candidate("dead_time", "absent", 499.0, "no longer significant once first-order rudder lag is included"),
            candidate("rudder_lag", "present", 437.0, "step 1"),
            candidate("backlash", "absent", 158.0, "significant by itself; not refitted, as others promised more"),
            candidate("waves", "absent", 1.0, "not seen; upper limit (95 %): |c| < 1"),
        ],
    }
    for outcome, third in (("explained", "not confirmed"), ("insufficient_data", "not judged")):
        monkeypatch.setattr(diagnosis, "document", lambda *_, of=outcome: {**content, "verdict": of})
        page = client.get("/diagnoses/dx-1").text
        assert re.findall(r"</a></th><td>([^<]*)</td>", page) == ["not needed", "present", third, "not seen"]
        assert "by score beside the plain model" in page and "likeliest" not in page


def test_a_size_that_no_ship_has_is_marked():
    def size(value: float, std: float | None, unit: str) -> dict[str, Any]:
        return {"value": value, "std": std, "unit": unit}

    lever = {"effect": "antenna_lever", "size": {"x": size(-193.9, 97.0, "m")}}
    assert sizes_of(lever, 161.0) == "x -193.9 ± 97 m (beyond what is physical)"
    assert sizes_of(lever, 400.0) == sizes_of(lever, None) == "x -193.9 ± 97 m"
    current = {"effect": "earth_current", "size": {"c2": size(1372.0, 633.0, "m/s")}}
    assert sizes_of(current, None).endswith("(beyond what is physical)")
    waves = {"effect": "waves", "size": {"c": size(0.002, 0.0004, "rad"), "k": size(2.5, None, "1")}}
    assert sizes_of(waves, 161.0) == "c 0.1146 ± 0.023 deg, k 2.5 (held)"
    assert sizes_of({"effect": "own", "size": {"c": size(1e9, 1.0, "1")}}, None) == "c 1e+09 ± 1"


def test_manoeuvres_are_named_by_their_log_where_a_logger_has_no_calendar():
    assert logs_begin_alike([("2006-01-01T00:00:01Z", "a"), ("2006-01-01T00:00:07Z", "b")])
    assert not logs_begin_alike([("2006-01-01T00:00:01Z", "a"), ("2006-01-01T00:00:07Z", "a"), ("2007-", "b")])


def test_a_wide_figure_scrolls_within_itself_and_a_narrow_one_does_not():
    wide, narrow = (str(drawing(width, 100.0, "figure", Markup())) for width in (640.0, 400.0))
    assert wide.startswith('<div class="scroll" tabindex="0"><svg') and 'class="drawing wide"' in wide
    assert 'class="drawing"' in narrow
    assert 'class="drawing map"' in str(drawing(640.0, 100.0, "track", Markup(), kind="map"))
