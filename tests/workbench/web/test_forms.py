"""What is asked for by forms, beside the command line: logs, corrections, notes, predictions, formulas, comparisons."""

from __future__ import annotations

import gzip
import re
from html import unescape
from pathlib import Path
from typing import Any

import pytest
from starlette.testclient import TestClient

from kempf.workbench.web import uploads
from kempf.workbench.web.jobs.engine_supervisor import EngineSupervisor
from kempf.workbench.web.jobs.queue import ACTIVE, Queue
from tests.workbench.driving import kempf
from tests.workbench.web.conftest import OURS, until

Working = tuple[TestClient, EngineSupervisor, Queue]


def done(client: TestClient, answer: Any) -> dict[str, Any]:
    """What became of a job that a form asked for; its page opens."""
    assert answer.status_code == 303, answer.text
    place = answer.headers["location"]
    until(lambda: client.get(place + ".json").json()["state"] not in ACTIVE)
    page = client.get(place)
    assert page.status_code == 200, page.text
    return {**client.get(place + ".json").json(), "page": page.text}


def asked(client: TestClient, kind: str, **fields: str) -> dict[str, Any]:
    return done(client, client.post("/jobs", data={"kind": kind, "vessel": "mariner", **fields}, headers=OURS))


def form_of(page: str, button: str) -> str:
    """The one form of a page that has a button."""
    (form,) = [f for f in re.findall(r"<form.*?</form>", page, re.DOTALL) if f">{button}</button>" in f]
    return form


def hidden(page: str, button: str) -> dict[str, str]:
    """The fields of the form that a button of a page sends."""
    form = form_of(page, button)
    found = {name: unescape(value) for name, value in re.findall(r'name="(\w+)" value="([^"]*)"', form)}
    for name, options in re.findall(r'<select name="(\w+)">(.*?)</select>', form):
        listed = re.findall(r'<option( value="([^"]*)")?( selected)?>([^<]*)<', options)
        stated, value, _, words = next((one for one in listed if one[2]), listed[0])
        found[name] = value if stated else words
    return {name: value for name, value in found.items() if name not in ("kind", "vessel")}


def test_a_log_that_is_sent_is_the_log_that_is_ingested(working: Working, logs: Path):
    client, _, _ = working
    held = {one["log_id"] for one in client.get("/v/mariner/logs.json").json()}
    content = (logs / "mariner.csv.gz").read_bytes()
    again = client.post("/ingest", data={"vessel": "mariner"}, files={"log": ("day.csv.gz", content)}, headers=OURS)
    job = done(client, again)
    assert [one["outcome"] for one in job["result"]["outcomes"]] == ["unchanged"]
    assert {one["log_id"] for one in client.get("/v/mariner/logs.json").json()} == held
    profile = ("profile", ("sister.yaml", (logs / "profile.yaml").read_bytes().replace(b"mariner", b"sister")))
    sisters = b"".join(gzip.decompress(content).splitlines(keepends=True)[:-1])  # a log is one vessel's
    files = [("log", ("../../<b>mariner.csv", sisters)), profile]
    new = done(client, client.post("/ingest", data={"new_vessel": "yes"}, files=files, headers=OURS))
    (one,) = new["result"]["outcomes"]
    assert one["outcome"] == "new" and "<b>" not in new["page"]
    for name in one["segments"]:  # by what it is, not "manoeuvre to fit" three times
        assert re.search(rf'href="/segments/{name}">\d+/\d+ zigzag to (starboard|port)</a>', new["page"])
    listed = client.get("/v/sister/logs.json").json()
    assert [row["file_name"] for row in listed] == ["<b>mariner.csv"] and listed[0]["records_kept"] > 0


def test_a_log_that_does_not_describe_itself_comes_in_with_a_drafted_profile(working: Working, logs: Path):
    client, _, _ = working
    content = b"".join(gzip.decompress((logs / "mariner.csv.gz").read_bytes()).splitlines(keepends=True)[:-1])
    sent = {"data": {"vessel": "sister", "new_vessel": "yes"}, "files": {"log": ("mariner.csv", content)}}
    failed = done(client, client.post("/ingest", **sent, headers=OURS))
    assert failed["error"]["code"] == "no_source_for_log"
    text = re.search(r"<textarea[^>]*>(.*?)</textarea>", failed["page"], re.DOTALL)
    assert text is not None and "Run it again" not in failed["page"] and "kempf profile" not in failed["page"]
    draft = unescape(text[1])
    assert 'vessel: "sister"' in draft and '{channel: "yaw_rate?"' in draft
    place = f"/jobs/{failed['id']}/profile"
    uncorrected = client.post(place, data={"profile": draft}, headers=OURS)
    assert uncorrected.status_code == 400 and "?" in uncorrected.text
    assert client.post(place, data={"profile": draft}).status_code == 403
    corrected = draft.replace("?", "")
    new = done(client, client.post(place, data={"profile": corrected}, headers=OURS))
    assert [one["outcome"] for one in new["result"]["outcomes"]] == ["new"], new
    assert [row["file_name"] for row in client.get("/v/sister/logs.json").json()] == ["mariner.csv"]


def test_what_is_no_log_or_nobodys_is_refused_in_words(working: Working, monkeypatch: pytest.MonkeyPatch):
    client, _, _ = working
    pdf = {"log": ("report.pdf", b"%PDF-1.7\nno log")}
    failed = done(client, client.post("/ingest", data={"vessel": "mariner"}, files=pdf, headers=OURS))
    assert failed["error"]["code"] == "unknown_format" and "is a PDF document" in failed["page"]
    assert ">done<" not in failed["page"] and 'href="/ingest">Send' in failed["page"]
    assert client.post(f"/jobs/{failed['id']}/again", headers=OURS).status_code == 303
    for data, files, status, code in (
        ({"vessel": "marinner"}, pdf, 404, "no_vessel"),
        ({}, pdf, 400, "no_vessel_named"),
        ({"vessel": "mariner"}, {"other": ("a", b"")}, 400, "no_file"),
    ):
        refused = client.post("/ingest", data=data, files=files, headers=OURS)
        assert (refused.status_code, code in refused.text) == (status, True), refused.text
    assert client.post("/ingest", data={"vessel": "mariner"}, headers=OURS).status_code == 400
    monkeypatch.setattr(uploads, "MOST_BYTES", 1000)
    large = client.post("/ingest", data={"vessel": "mariner"}, files={"log": ("a", bytes(2000))}, headers=OURS)
    assert large.status_code == 413 and "kempf ingest LOG" in large.text
    monkeypatch.setattr(uploads, "AT_ONCE", 0)
    assert client.post("/ingest", data={}, files=pdf, headers=OURS).status_code == 503


def test_a_correction_is_previewed_stored_and_taken_back(working: Working, own: Path):
    client, _, _ = working
    before = client.get("/v/mariner/segments.json").json()
    name = before[0]["segment_id"]
    fields = {"action": "exclude", "segment": name, "reason": "tugs <b>alongside</b>"}
    seen = asked(client, "preview", **fields)
    assert client.get("/v/mariner/segments.json").json() == before  # nothing is stored
    assert seen["result"]["planned"]["following"]["superseded"] and "<b>" not in seen["page"]
    stored = asked(client, "correct", **hidden(seen["page"], "Store it"))
    # the page stays: what undoes it, and what follows, is nowhere else
    assert stored["result"]["to"] == f"/jobs/{stored['id']}" and "are superseded" in stored["page"]
    assert 'value="reprocess"' in form_of(stored["page"], "Identify her again")
    assert client.get(f"/segments/{name}.json").json()["excluded"] == fields["reason"]
    printed = kempf("segments", "corrections", "--vessel", "mariner", "--warehouse", own, "--json").json
    assert [one["action"] for one in printed] == ["exclude"]
    back = asked(client, "preview", **hidden(stored["page"], "Undo it: preview"))
    asked(client, "correct", **hidden(back["page"], "Store it"))
    after = client.get("/v/mariner/segments.json").json()
    assert after[0]["excluded"] is None
    assert [(s["start"], s["end"]) for s in after] == [(s["start"], s["end"]) for s in before]
    # and excluded once more: the same request, of a state that was there before
    asked(client, "correct", **hidden(asked(client, "preview", **fields)["page"], "Store it"))
    assert client.get(f"/segments/{name}.json").json()["excluded"] == fields["reason"]


@pytest.mark.parametrize(
    ("fields", "status", "code"),
    [
        ({"kind": "preview", "action": "forget"}, 400, "action_unknown"),
        ({"kind": "preview", "action": "correct", "from": "noon", "to": "later"}, 400, "instant_unreadable"),
        ({"kind": "correct", "action": "exclude", "reason": "x" * 3000}, 400, "reason_too_long"),
        ({"kind": "try", "formula": "yaw: r*abs("}, 400, "formula"),
        ({"kind": "try", "formula": "yaw: " + "r*" * 600}, 400, "formula_too_long"),
        ({"kind": "sail", "manoeuvre": "loop"}, 400, "manoeuvre_unknown"),
        ({"kind": "sail", "rudder": "hard"}, 400, "number_unreadable"),
        ({"kind": "sail", "rudder": "90"}, 400, "rudder_out_of_range"),
        ({"kind": "sail", "manoeuvre": "zigzag", "angles": "20"}, 400, "angles_unreadable"),
        ({"kind": "sail", "speed": "0"}, 400, "speed_out_of_range"),
        ({"kind": "explain", "from": "2025-05-03T06:00:00Z", "to": "2025-05-03T05:00:00Z"}, 400, "window_empty"),
        ({"kind": "explain", "from": "", "to": ""}, 400, "instant_unreadable"),
        ({"kind": "what_if", "set": "ps-nothing"}, 404, "no_parameter_set"),
    ],
)
def test_a_slip_of_the_pen_is_said_before_anything_waits(
    writing: TestClient, fields: dict[str, str], status: int, code: str
):
    answer = writing.post("/jobs", data={"vessel": "mariner", **fields}, headers=OURS)
    assert (answer.status_code, code in answer.text) == (status, True), answer.text


def test_a_note_is_text_whatever_is_in_it(working: Working, own: Path):
    client, _, _ = working
    segment = client.get("/v/mariner/segments.json").json()[0]["segment_id"]
    words = "docked <script>alert(1)</script>"
    note = {"vessel": "mariner", "text": words, "at": "2025-05-03", "draught": "8.1"}
    assert client.post("/notes", data=note, headers=OURS).headers["location"] == "/v/mariner#notes"
    on = client.post("/notes", data={"segment": segment, "text": "gust"}, headers=OURS)
    assert on.headers["location"] == f"/segments/{segment}"
    assert "<script>alert" not in client.get("/v/mariner").text and "gust" in client.get(f"/segments/{segment}").text
    printed = kempf("note", "--vessel", "mariner", "--warehouse", own, "--json").json
    assert [(one["text"], one["draught_m"]) for one in printed] == [(words, 8.1), ("gust", None)]
    for fields, status in (
        ({"vessel": "mariner", "text": " "}, 400),
        ({"vessel": "mariner", "text": "x" * 2001}, 400),
        ({"vessel": "mariner", "text": "x", "at": "noon"}, 400),
        ({"vessel": "mariner", "text": "x", "draught": "deep"}, 400),
        ({"vessel": "nobody", "text": "x"}, 404),
        ({"text": "x"}, 400),
    ):
        assert client.post("/notes", data=fields, headers=OURS).status_code == status, fields
    assert client.post("/notes", data=note).status_code == 403


@pytest.mark.parametrize(
    ("place", "button", "choices"),
    [
        ("predict", "Predict it", {"manoeuvre": "zigzag", "angles": "10/10"}),
        ("what-if", "Move it", {"parameter": "b2"}),
        ("next-trial", "Find the next trial", {"parameter": "b2"}),
    ],
)
def test_what_is_chosen_is_what_the_button_asks_for(
    writing: TestClient, place: str, button: str, choices: dict[str, str]
):
    page = writing.get(f"/v/mariner/{place}").text
    form = form_of(page, button)
    assert ">Show<" not in page and form.count("<button") == 1 and 'method="post"' in form
    assert all(re.search(f'<(select|input) name="{name}"', form) for name in choices)
    kind = re.search(r'name="kind" value="(\w+)"', form)
    assert kind is not None
    fields = {"kind": kind[1], "vessel": "mariner", **hidden(page, button), **choices}
    asked_for = writing.get(writing.post("/jobs", data=fields, headers=OURS).headers["location"] + ".json").json()
    assert choices.items() <= asked_for["arguments"].items()
    # where it is being made is said at the address of the choice
    assert asked_for["id"] in writing.get(f"/v/mariner/{place}", params={**hidden(page, button), **choices}).text


def test_one_who_may_only_read_looks_at_what_is_made(client: TestClient):
    page = client.get("/v/mariner/predict").text
    form = form_of(page, "Show")
    assert 'method="get"' in form and 'action="/v/mariner/predict"' in form and "Predict it: open the address" in page


def test_a_manoeuvre_is_predicted_as_the_command_predicts_it(working: Working, own: Path):
    client, _, _ = working
    place = "/v/mariner/predict?manoeuvre=zigzag&angles=20/20"
    assert "not predicted yet" in client.get(place).text
    assert client.get(place.replace("predict?", "predict.json?")).json() is None
    job = asked(client, "sail", **hidden(client.get(place).text, "Predict it"))
    place = job["result"]["to"]
    page = client.get(place)
    assert page.status_code == 200 and len(page.content) < 100_000 and "IMO" in page.text
    assert re.search(r'href="/segments/seg-[0-9a-f]+">20/20 zigzag to starboard, 20\d\d-', page.text)
    assert "--" not in page.text.partition("<main")[2].replace("<!--", "")
    printed = kempf(
        *("predict", "zigzag", "--angles", "20/20", "--vessel", "mariner", "--compare"), "--warehouse", own, "--json"
    ).json
    assert client.get(place.replace("predict?", "predict.json?")).json() == printed
    # asked for once more it is there at once
    once_more = {"kind": "sail", "vessel": "mariner", **hidden(page.text, "Predict it")}
    assert client.post("/jobs", data=once_more, headers=OURS).headers["location"] == place


def test_what_limits_a_prediction_is_above_its_figures_and_measured_circles_are_named(
    writing: TestClient, tmp_path: Path
):
    page = writing.get("/v/mariner/predict").text
    fields = {"kind": "sail", "vessel": "mariner", **hidden(page, "Predict it")}
    writing.post("/jobs", data=fields, headers=OURS)
    queue = Queue(tmp_path / "state" / "jobs.sqlite")
    (job,) = queue.active()
    queue.take()
    figure = {"value": 1.193, "low": 1.1, "high": 1.3}
    beside = {"figure": "steady_yaw_rate_deg_s", "measured": 1.64, "measured_low": None, "measured_high": None}
    measured = {
        "segment_id": "seg-1",
        "side": "port",
        "sample": "held_out",
        "why": "",
        "figures": [{**beside, **figure}],
    }
    measured["figures"][0]["inside"] = True
    why = "extrapolated in drift angle and rudder"
    advance = {"name": "advance", "limit": 724.2, "unit": "m", "probability": 0.84, "why": why}
    document = {
        "manoeuvre": {"kind": "turning-circle", "rudder_deg": 35.0, "side": "starboard"},
        "figures": {"steady_yaw_rate_deg_s": figure},
        "imo": [advance],
        "extrapolated": [{"sentence": "rudder up to 35 deg, the logs cover 20 deg"}],
        "limits": ["42 of 256 ships that the errors allow do not sail it"],
        "measured": [measured],
        "assumed": [],
    }
    curve = [[float(k), 0.0, 0.1, 0.0, 5.0, 10.0 * k, float(k)] for k in range(3)]
    queue.finish(job.id, {"to": "/", "document": document, "curves": {"estimates": [curve], "ships": []}})
    page = writing.get("/v/mariner/predict").text
    places = [page.index(words) for words in ("Extrapolated: rudder", "42 of 256", "<h2>Figures", "<h2>IMO", why)]
    assert places == sorted(places) and "probability of 84 %" in page
    table = page[page.index("<h2>Measured") :]
    assert "yaw rate in the last turn" in table and "steady yaw rate" not in table
    assert "while her speed still falls" in table and "steady yaw rate" in page


def test_the_next_trial_is_the_one_that_the_command_proposes(working: Working, own: Path):
    client, _, _ = working
    page = client.get("/v/mariner/next-trial?parameter=b2").text
    job = asked(client, "next_trial", **hidden(page, "Find the next trial"))
    page = client.get(job["result"]["to"])
    assert page.status_code == 200 and len(page.content) < 100_000 and "Sailing order" in page.text
    found = client.get(job["result"]["to"].replace("next-trial?", "next-trial.json?")).json()
    printed = kempf("next-trial", "--parameter", "b2", "--vessel", "mariner", "--warehouse", own, "--json").json
    assert found == printed and all(step in page.text for step in found["order"])


def test_a_parameter_is_moved_and_its_price_has_its_least_at_the_estimate(working: Working, own: Path):
    client, _, _ = working
    job = asked(client, "what_if", **hidden(client.get("/v/mariner/what-if?parameter=b1").text, "Move it"))
    page = client.get(job["result"]["to"])
    assert page.status_code == 200 and len(page.content) < 100_000 and page.text.count("line-try") >= 9
    assert re.search(r'<option value="seg-[0-9a-f]+">20/20 zigzag to starboard, 20\d\d-', page.text)
    found = client.get(job["result"]["to"].replace("what-if?", "what-if.json?")).json()
    assert found == kempf("what-if", "b1", "--vessel", "mariner", "--warehouse", own, "--json").json
    prices = [one["log_likelihood_falls_by"] for one in found["tried"]]
    assert prices[4] == 0.0 and prices[:5] == sorted(prices[:5], reverse=True) and prices[4:] == sorted(prices[4:])
    # held, the others make it dearer than the parameter's own standard error says
    assert all(price > 0.4 * one["in_std"] ** 2 for price, one in zip(prices, found["tried"], strict=True) if price)
    compared = kempf("compare", "--vessel", "mariner", "--warehouse", own, "--json").json
    (held_or_fitted,) = [one for one in compared["summary"].values() if one and one["runs"] == 1]
    mean = held_or_fitted["free_run_error_percent"]["mean"]
    assert found["tried"][4]["free_run_error_percent"] == pytest.approx(mean, rel=1e-9)
    refused = kempf("what-if", "b9", "--vessel", "mariner", "--warehouse", own, "--json")
    assert refused.code == 4 and refused.json["error"]["code"] == "no_parameter"


def test_two_sets_are_compared_as_the_command_compares_them(working: Working, own: Path):
    client, _, _ = working
    assert client.get("/compare").status_code == 200
    first, *_, second = (one["parameter_set_id"] for one in client.get("/v/mariner/sets.json").json())
    page = client.get(f"/compare?a={first}&b={second}")
    assert page.status_code == 200 and "Which inputs differ" in page.text and "Predict with" in page.text
    printed = kempf("params", "diff", first, second, "--warehouse", own, "--json").json
    assert client.get(f"/compare.json?a={first}&b={second}").json() == printed
    assert client.get(f"/compare?a={first}&b=ps-nothing").status_code == 404
    asked(client, "predict", set=second, horizon="free")
    beside = client.get(f"/v/mariner/model?set={second}&beside={first}")
    assert beside.status_code == 200 and "Predict with it" in beside.text
    for short, words in (("1", "one step"), ("10s", "10 s"), ("60s", "60 s")):  # made with it: no page has to wait
        page = client.get(f"/v/mariner/model?set={second}&h={short}").text
        # the errors are those of this horizon, the free run's beside them
        assert "not made yet" not in page and "rms of yaw rate, deg/s</th>" in page
        assert re.search(rf"Rms errors: {words}[^<]*\. Free-run errors", page)
        assert re.search(r"(times the errors of a right model|rms [0-9.]+ deg)[^<]* zigzag to ", page)
