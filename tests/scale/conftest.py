from __future__ import annotations

import gzip
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from importlib import import_module
from pathlib import Path

import pytest

from kempf.flows.jobs.identify.identify_vessel import Request, identify_vessel
from kempf.flows.jobs.ingest.ingest_logs import ingest_log
from kempf.pipeline.ingest.log_file import LogFile
from kempf.schemas.profile import VesselProfile
from kempf.warehouse.storage.store import Warehouse
from kempf.warehouse.tables import vessels
from tests.conftest import Ship
from tests.scale.servers import environment, free_port, running, s3_server

KEYS = {"AWS_ACCESS_KEY_ID": "testing", "AWS_SECRET_ACCESS_KEY": "testing"}


@dataclass(frozen=True)
class Bucket:
    """An S3 server of our own with one bucket, and the settings with which it is reached."""

    uri: str
    settings: dict[str, str] = field(repr=False)


@pytest.fixture(scope="session")
def bucket(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Bucket]:
    pytest.importorskip("moto", reason="moto[server] is not installed: no S3 server to try")
    from pyarrow import fs

    port, log = free_port(), tmp_path_factory.mktemp("s3") / "log"
    with running(s3_server(port), environment(), log, port=port):
        settings = {**KEYS, "AWS_ENDPOINT_URL": f"http://127.0.0.1:{port}"}
        store = fs.S3FileSystem(
            access_key="testing",
            secret_key="testing",  # noqa: S106 - that of a server that lives as long as the test
            endpoint_override=settings["AWS_ENDPOINT_URL"],
            region="us-east-1",
            scheme="http",
            allow_bucket_creation=True,
        )
        store.create_dir("fleet")
        yield Bucket("s3://fleet", settings)


FLEET = ("cutter", "ferry", "sloop")


@pytest.fixture(scope="session")
def stocked(ferry: Ship, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A warehouse in a folder: three vessels with a log each, identified by the quickest estimator, to be copied."""
    place = tmp_path_factory.mktemp("stocked") / "w"
    rows = gzip.decompress(ferry.csv)
    for k, name in enumerate(FLEET):
        profile = VesselProfile.model_validate({**ferry.profile, "vessel": name})
        data = gzip.compress(rows, compresslevel=k + 1, mtime=0)  # other bytes, so another log
        outcome = ingest_log(Warehouse(str(place)), name, f"{name}.csv.gz", LogFile(data), profile, name)
        assert outcome.outcome == "new"
        (found,) = identify_vessel(Warehouse(str(place)), name, Request(estimator="least-squares"))
        assert found.parameter_set is not None
    return place


def touch(warehouse: Warehouse, *names: str) -> None:
    """Change a little in the profiles of some vessels, so that they have to be read and identified anew."""
    for name in names:
        profile = vessels.current(warehouse, name)
        arm = (profile.wind_arm_per_m or 0.0) + 0.001
        vessels.register(warehouse, name, profile.model_copy(update={"wind_arm_per_m": arm}))


@dataclass(frozen=True)
class Server:
    """A Prefect server that runs as docs/fleet.md starts it, and what the programs beside it are given."""

    url: str
    settings: dict[str, str]


@contextmanager
def prefect_server(home: Path) -> Iterator[Server]:
    """Start a Prefect server that keeps what it knows in a folder."""
    port = free_port()
    settings = {
        "PREFECT_HOME": str(home),
        "PREFECT_API_URL": f"http://127.0.0.1:{port}/api",
        "PREFECT_SERVER_API_PORT": str(port),
        "DO_NOT_TRACK": "1",
        "PREFECT_SERVER_ANALYTICS_ENABLED": "false",
        # only so that the tests wait less
        "PREFECT_SERVER_SERVICES_SCHEDULER_LOOP_SECONDS": "1",
        "PREFECT_WORKER_QUERY_SECONDS": "1",
        "PREFECT_RUNNER_POLL_FREQUENCY": "1",
    }
    command = ["prefect", "server", "start", "--host", "127.0.0.1"]
    with running(command, environment(**settings), home / "log", port=port):
        yield Server(settings["PREFECT_API_URL"], settings)


@pytest.fixture(scope="session")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Server]:
    with prefect_server(tmp_path_factory.mktemp("prefect")) as started:
        yield started


@pytest.fixture
def on_server(server: Server) -> Iterator[None]:
    """The flows of this process report to the server."""
    with reporting_to(server):
        yield


@contextmanager
def reporting_to(server: Server) -> Iterator[None]:
    import_module("kempf.flows.fleet.engine")  # first: it sets what Prefect reads when it is imported
    from prefect.settings import PREFECT_API_URL, PREFECT_HOME, temporary_settings

    with temporary_settings({PREFECT_API_URL: server.url, PREFECT_HOME: server.settings["PREFECT_HOME"]}):
        yield
