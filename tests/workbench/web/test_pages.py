"""Every page: what it shows, what it is beside the command line, and what it says where there is nothing."""

from __future__ import annotations

import hashlib
import re
import subprocess
import sys
from contextlib import redirect_stdout, suppress
from importlib.resources import files
from io import BytesIO, TextIOWrapper
from pathlib import Path

import pytest
from starlette.testclient import TestClient

from kempf.pipeline.ingest.decoded import LostStretch
from kempf.schemas.instants import iso_utc
from kempf.schemas.units import SECOND_NS
from kempf.warehouse.storage import delta
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import logs, notes
from kempf.workbench import static_files
from kempf.workbench.cli.entry import main
from kempf.workbench.web.addresses import of_vessel
from kempf.workbench.web.pages.spans import spans_of_lost
from tests.workbench.driving import environment, kempf
from tests.workbench.web.conftest import TOKEN, client_of
from tests.workbench.web.decoded import decoded


def ids(client: TestClient) -> dict[str, str]:
    """One id of each kind."""
    return {
        "log": client.get("/v/mariner/logs.json").json()[0]["log_id"],
        "segment": client.get("/v/mariner/segments.json").json()[0]["segment_id"],
        "set": client.get("/v/mariner/sets.json").json()[-1]["parameter_set_id"],
    }


def pages(client: TestClient) -> list[str]:
    """Every page that the warehouse has."""
    found = ids(client)
    return [
        *("/", "/v/mariner", "/effects", "/effects/wind_force"),
        *(f"/logs/{found['log']}", f"/segments/{found['segment']}", f"/sets/{found['set']}"),
    ]


def test_every_page_opens_and_every_address_on_it_leads_somewhere(client: TestClient):
    todo, seen = pages(client), set()
    while todo:
        path = todo.pop()
        if path in seen:
            continue
        seen.add(path)
        answer = client.get(path)
        assert answer.status_code == 200, (path, answer.text)
        if "text/html" in answer.headers["content-type"]:
            assert len(answer.content) < 100_000
            todo += re.findall(r'(?:href|src)="(/[^"#]*)"', answer.text)
    assert len(seen) > 60


def printed(*arguments: object) -> bytes:
    """What a command writes on a terminal that has every letter."""
    out = BytesIO()
    with redirect_stdout(TextIOWrapper(out, encoding="utf-8")) as stream, suppress(SystemExit):
        main([str(a) for a in arguments])
    stream.flush()
    return out.getvalue()


def test_what_is_at_json_is_what_the_command_prints_byte_for_byte(client: TestClient, filled: Path):
    found = ids(client)
    twins = {
        "/fleet.json": ("vessels", "list"),
        "/v/mariner.json": ("vessels", "show", "mariner"),
        "/v/mariner/logs.json": ("logs", "list", "--vessel", "mariner"),
        "/v/mariner/segments.json": ("segments", "--vessel", "mariner"),
        "/v/mariner/sets.json": ("params", "list", "--vessel", "mariner"),
        f"/logs/{found['log']}.json": ("logs", "show", found["log"]),
        f"/sets/{found['set']}.json": ("params", "show", found["set"]),
        "/effects.json": ("effects", "list"),
        "/effects/wind_force.json": ("effects", "show", "wind_force"),
        "/v/mariner/ladder.json": ("ladder", "--vessel", "mariner"),
    }
    for path, command in twins.items():
        place = () if command[0] == "effects" else ("--warehouse", filled)
        assert client.get(path).content == printed(*command, *place, "--json"), path
    whole = kempf("segments", "--vessel", "mariner", "--warehouse", filled, "--json").json
    assert client.get(f"/segments/{found['segment']}.json").json() == whole[0]


def test_series_are_those_of_the_log_at_every_zoom(client: TestClient):
    log = ids(client)["log"]
    answer = client.get(f"/logs/{log}/series?ch=heading,yaw_rate,rudder_angle&bins=300")
    head, found = decoded(answer.content)
    assert list(found) == ["heading", "yaw_rate", "rudder_angle"]
    assert len(answer.content) < 3 * 300 * 2 * 8 + 1000
    assert max(s["total"] for s in head["series"]) > 600
    one = client.get(f"/logs/{log}.json").json()
    begin = one["start"][:19] + "Z"
    inside, _ = decoded(client.get(f"/logs/{log}/series?ch=heading&from={begin}&to={one['end']}").content)
    assert int(inside["to_utc_ns"]) - int(inside["from_utc_ns"]) > 60 * 10**9


def test_notes_and_lost_stretches_are_behind_the_channels(own: Path, tmp_path: Path):
    warehouse = Warehouse(str(own))
    row = logs.current(warehouse, "mariner")[0]
    day = 24 * 3600 * SECOND_NS
    for at, text in ((row.start_utc_ns - 30 * day, "docked"), (row.start_utc_ns + 60 * SECOND_NS, "tug lets go")):
        notes.add(warehouse, "mariner", "vessel", "mariner", text, event_utc_ns=at)
    notes.add(warehouse, "mariner", "vessel", "mariner", "docked again", event_utc_ns=row.end_utc_ns + day)
    with client_of(own, tmp_path / "state") as client:
        page = client.get(f"/logs/{row.log_id}").text
        segment = client.get(f"/segments/{ids(client)['segment']}").text
    for text in (page, segment):
        assert re.findall(r'data-kind="note"[^>]*>([^<]*)<', text) == ["docked", "tug lets go"]
    assert page.count('data-kind="manoeuvre"') >= 1
    lost = [LostStretch(None, row.start_utc_ns + SECOND_NS, 3, "cut"), LostStretch(row.end_utc_ns, None, None, "cut")]
    spans = spans_of_lost(lost, row.start_utc_ns, row.end_utc_ns)
    assert [(one["from"], one["to"]) for one in spans] == [
        (iso_utc(row.start_utc_ns), iso_utc(row.start_utc_ns + SECOND_NS)),
        (iso_utc(row.end_utc_ns), iso_utc(row.end_utc_ns)),
    ]


def test_a_printed_sheet_says_where_it_is_from_and_gives_no_token_away(client: TestClient):
    page = client.get(f"/effects?token={TOKEN}", follow_redirects=True)
    (sheet,) = re.findall(r'<footer class="sheet">(.*)</footer>', page.text)
    assert re.fullmatch(r"http://127\.0\.0\.1/effects, printed 20\d\d-\d\d-\d\d", sheet)


def test_a_log_is_read_once_however_often_it_is_looked_at(client: TestClient, monkeypatch: pytest.MonkeyPatch):
    from kempf.workbench.web.data import channel_cache

    reads = []
    monkeypatch.setattr(
        channel_cache, "channels_of", lambda *a, of=channel_cache.channels_of: (reads.append(a), of(*a))[1]
    )
    log = ids(client)["log"]
    for path in (f"/logs/{log}", f"/logs/{log}/series?ch=heading", f"/logs/{log}/series?ch=yaw_rate&bins=50"):
        assert client.get(path).status_code == 200
    assert len(reads) == 1


def test_the_fleet_takes_at_most_eight_reads_of_tables(client: TestClient, monkeypatch: pytest.MonkeyPatch):
    reads = []
    monkeypatch.setattr(delta, "read", lambda *a, of=delta.read, **k: (reads.append(a[1]), of(*a, **k))[1])
    assert client.get("/").status_code == 200
    assert 3 <= len(reads) <= 8, reads


@pytest.mark.parametrize(
    ("path", "status", "says"),
    [
        ("/nothing", 404, "There is nothing at the address"),
        ("/v/nobody", 404, "mariner"),
        ("/v/~0000", 404, "No vessel has the address"),
        ("/logs/zzzz", 404, "log"),
        ("/segments/seg-0000", 404, "segment"),
        ("/sets/ps-0000", 404, "ps-0000"),
        ("/diagnoses/dx-0000", 404, "dx-0000"),
        ("/effects/nothing", 404, "nothing"),
        ("/v/mariner/ladder", 404, "kempf diagnose"),
        ("/go?q=nothing+of+this", 404, "neither a vessel"),
    ],
)
def test_what_is_not_there_is_a_page_in_words_with_the_next_step(client: TestClient, path: str, status: int, says: str):
    answer = client.get(path)
    assert answer.status_code == status
    assert says in answer.text and "<strong>" in answer.text and "Traceback" not in answer.text


@pytest.mark.parametrize(
    ("query", "code"),
    [
        ("ch=nothing", "channel_unknown"),
        ("ch=", "channel_unknown"),
        ("ch=heading&from=yesterday", "instant_unreadable"),
        ("ch=heading&from=" + "9" * 60, "instant_unreadable"),
        ("ch=heading&from=2030-01-01T00:00:00Z&to=2029-01-01T00:00:00Z", "window_empty"),
        ("ch=heading&bins=-1", "bins_unreadable"),
        ("ch=heading&bins=0", "bins_unreadable"),
        ("ch=heading&bins=²", "bins_unreadable"),
        ("ch=heading&bins=" + "9" * 5000, "bins_unreadable"),
        ("ch=" + ",".join(f"c{k}" for k in range(20)), "too_many_channels"),
    ],
)
def test_a_chart_that_cannot_be_drawn_says_why(client: TestClient, query: str, code: str):
    answer = client.get(f"/logs/{ids(client)['log']}/series?{query}")
    assert answer.status_code == 400
    assert answer.json()["error"]["code"] == code


def test_what_is_typed_leads_to_its_page(client: TestClient):
    found = ids(client)
    for typed, to in (
        ("mariner", "/v/mariner"),
        (" wind_force ", "/effects/wind_force"),
        (found["log"][:12], f"/logs/{found['log'][:12]}"),
        (found["segment"], f"/segments/{found['segment']}"),
        (found["set"], f"/sets/{found['set']}"),
    ):
        answer = client.get("/go", params={"q": typed})
        assert (answer.status_code, answer.headers["location"]) == (303, to)
        assert client.get(to).status_code == 200


SCRIPT = "<script>alert(1)</script>"


def test_what_people_wrote_is_shown_as_text(own: Path, tmp_path: Path):
    hostile = f'{SCRIPT}"><img src=x onerror=alert(1)>'
    assert kempf("note", "--vessel", "mariner", hostile, "--warehouse", own).code == 0
    assert kempf("vessels", "rename", "mariner", hostile, "--reason", hostile, "--yes", "--warehouse", own).code == 0
    with client_of(own, tmp_path / "state") as client:
        segment = client.get(of_vessel(hostile) + "/segments.json").json()[0]["segment_id"]
        done = kempf("segments", "exclude", segment, "--reason", hostile, "--yes", "--warehouse", own)
        assert done.code == 0, done
        log = client.get(of_vessel(hostile) + "/logs.json").json()[0]["log_id"]
        for path in ("/", of_vessel(hostile), f"/segments/{segment}", f"/logs/{log}", f"/go?q={hostile}", f"/{SCRIPT}"):
            answer = client.get(path)
            shown = answer.text.replace('<script src="/static', "")
            assert "<script>" not in shown and "<img" not in shown, path
            assert answer.status_code in (200, 303, 404)
        assert "&lt;script&gt;" in client.get(of_vessel(hostile)).text


def test_no_template_lets_text_through_as_markup():
    for one in (files("kempf.workbench.web") / "templates").iterdir():
        assert not re.search(r"\|\s*safe|autoescape|style=|<script(?![^>]*src=)| on\w+=", one.read_text()), one.name


def test_what_others_wrote_is_as_they_wrote_it():
    served = static_files.contents()
    manifest = (files("kempf.workbench") / "static" / "vendor" / "SHA256SUMS").read_text().split("\n")
    named = {line.split()[1]: line.split()[0] for line in manifest if line}
    assert {f"vendor/{name}" for name in named} >= {name for name in served if name.startswith("vendor/")}
    for name, (content, _) in served.items():
        if name.startswith("vendor/"):
            assert hashlib.sha256(content).hexdigest() == named[name.removeprefix("vendor/")]
    ours = [content.decode() for name, (content, _) in served.items() if not name.startswith("vendor/")]
    assert not any(
        "innerHTML" in text or "eval(" in text or "http://" in text.replace("http://www.w3.org", "") for text in ours
    )
    assert sum(len(content) for content, _ in served.values()) < 120_000


def test_a_browser_does_not_load_what_it_has(client: TestClient):
    first = client.get("/static/chart.js")
    assert client.get("/static/chart.js", headers={"if-none-match": first.headers["etag"]}).status_code == 304


def test_pages_load_no_engine(filled: Path, tmp_path: Path):
    ask = (
        "import sys\n"
        "from pathlib import Path\n"
        "from tests.workbench.web.conftest import TOKEN, client_of\n"
        "from tests.workbench.web.test_pages import pages\n"
        f"with client_of(Path({str(filled)!r}), Path({str(tmp_path)!r})) as client:\n"
        "    for path in pages(client):\n"
        "        assert client.get(path).status_code == 200, path\n"
        "print(sorted({'numba', 'prefect', 'matplotlib', 'scipy'} & {m.partition('.')[0] for m in sys.modules}))\n"
    )
    done = subprocess.run([sys.executable, "-c", ask], capture_output=True, text=True, env=environment(), check=False)
    assert (done.returncode, done.stdout.strip()) == (0, "[]"), done.stderr
