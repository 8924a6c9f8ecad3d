"""Which requests are answered, and what a browser may do with the answer."""

from __future__ import annotations

from pathlib import Path

import pytest
from starlette.testclient import TestClient

from kempf.warehouse.storage.store import Warehouse
from kempf.workbench.web.app import create_app
from kempf.workbench.web.guard import HEADERS
from kempf.workbench.web.settings import Settings


@pytest.mark.parametrize("host", ["evil.example", "evil.example:8765", "127.0.0.1.evil.example", "", "[::2]:80"])
def test_a_name_that_is_not_ours_is_refused_whatever_it_points_to(client: TestClient, host: str):
    answer = client.get("/", headers={"host": host})
    assert answer.status_code == 421
    assert "--allow-host" in answer.text and "<" not in answer.text


@pytest.mark.parametrize("host", ["127.0.0.1:8765", "localhost", "LOCALHOST:1", "[::1]:8765"])
def test_the_loopback_is_answered_by_any_of_its_names(client: TestClient, host: str):
    assert client.get("/", headers={"host": host}).status_code == 200


@pytest.mark.parametrize("method", ["PUT", "DELETE", "PATCH", "OPTIONS"])
def test_other_methods_are_refused(client: TestClient, method: str):
    answer = client.request(method, "/v/mariner", headers={"origin": "http://evil.example"})
    assert answer.status_code == 405
    assert not any(name.startswith("access-control") for name in answer.headers)


def test_another_site_reads_nothing_and_may_link_here(client: TestClient):
    asked = {"sec-fetch-site": "cross-site"}
    assert client.get("/fleet.json", headers={**asked, "sec-fetch-mode": "cors"}).status_code == 403
    assert client.get("/", headers={**asked, "sec-fetch-mode": "navigate"}).status_code == 200


@pytest.mark.parametrize("path", ["/", "/v/mariner", "/nothing", "/fleet.json", "/static/chart.js", "/sets/ps-0000"])
def test_every_answer_carries_the_policy(client: TestClient, path: str):
    answer = client.get(path)
    for name, value in HEADERS.items():
        assert answer.headers[name] == value
    assert "unsafe" not in answer.headers["content-security-policy"]


@pytest.mark.parametrize(
    "path",
    [
        "/static/../app.py",
        "/static/%2e%2e/app.py",
        "/static/vendor/..%2f..%2fapp.py",
        "/static//etc/passwd",
        "/logs/..%2f..%2fetc%2fpasswd",
        "/v/..%2f..%2fetc",
        "/v/~..%2f",
        "/segments/%00",
        "/effects/..%2fsymbols",
    ],
)
def test_no_address_becomes_the_path_of_a_file(client: TestClient, path: str):
    answer = client.get(path)
    assert answer.status_code in (400, 404)
    assert "root:" not in answer.text and "import" not in answer.text


def test_on_another_address_nobody_reads_without_the_token(filled: Path, tmp_path: Path):
    def client(token: str | None) -> TestClient:
        settings = Settings("0.0.0.0", allowed_hosts=("ship.example",), token=token)  # noqa: S104
        app = create_app(Warehouse(str(filled)), settings, tmp_path / "state")
        return TestClient(app, base_url="http://ship.example", follow_redirects=False)

    with client("secret") as one:
        for path in ("/", "/fleet.json", "/static/chart.js"):
            refused = one.get(path)
            assert refused.status_code == 403 and "printed when it started" in refused.text
        assert one.get("/?token=wrong").status_code == 303 and one.get("/").status_code == 403
        one.get("/?token=secret")
        assert one.get("/").status_code == 200
    with client(None) as one:  # read-only: shown to whoever may come here
        assert one.get("/").status_code == 200
        assert one.post("/jobs", data={}, headers={"origin": "http://ship.example"}).status_code == 403
