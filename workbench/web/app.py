"""The application: every address, and what an error becomes."""

from __future__ import annotations

import sys
import traceback
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any
from urllib.parse import parse_qsl

from fastapi import FastAPI
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException
from starlette.requests import Request
from starlette.responses import FileResponse, HTMLResponse, RedirectResponse, Response

from kempf.flows.process.wrap_error import wrapped
from kempf.schemas.errors import KempfError, NotFound, UsageError
from kempf.warehouse.storage.store import Warehouse
from kempf.workbench.documents.text import json_text
from kempf.workbench.web import static_routes
from kempf.workbench.web.addresses import address_of, vessel_at
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.data import reports
from kempf.workbench.web.form_numbers import whole_number
from kempf.workbench.web.guard import Guard
from kempf.workbench.web.pages import (
    changes,
    compare,
    diagnosis,
    effects,
    explain,
    fleet,
    ingest,
    job,
    jobs,
    ladder,
    log,
    manoeuvre,
    model,
    next_trial,
    notes,
    parameter_set,
    predict,
    series,
    vessel,
    what_if,
)
from kempf.workbench.web.pages import error as error_page
from kempf.workbench.web.pages.page import Page
from kempf.workbench.web.settings import Settings
from kempf.workbench.web.templating import rendered

#: Of a chart: no screen is so wide.
_MOST_BINS = 99_999
#: What an error's exit code is as the status of an answer.
_STATUS = {1: 500, 2: 400, 3: 422, 4: 404, 5: 422}
#: What some errors are: gone in a moment, too late, too large.
_STATUS_OF_CODE = {
    "warehouse_busy": 503,
    "warehouse_unreachable": 503,
    "uploads_busy": 503,
    "jobs_full": 503,
    "moved_meanwhile": 409,
    "job_over": 409,
    "upload_too_large": 413,
}
Fields = Mapping[str, str]
#: bytes that a form may have, and one with a profile
_MOST_FORM, _MOST_PROFILE = 16_384, 262_144


def create_app(warehouse: Warehouse, settings: Settings, state: Path) -> FastAPI:
    """Return the application over a warehouse.

    Parameters
    ----------
    state : Path
        Folder of the jobs and of what was computed for pages.
    """
    app = FastAPI(docs_url=None, redoc_url=None, openapi_url=None, redirect_slashes=False)
    app.middleware("http")(Guard(settings))
    static_routes.serve(app)
    app_state = AppState(warehouse, state)
    app.state.queue = app_state.queue
    _serve_pages(app, app_state)
    _serve_jobs(app, app_state)
    for kind in (KempfError, HTTPException, Exception):
        app.add_exception_handler(kind, _refused)
    return app


def _serve_pages(app: FastAPI, app_state: AppState) -> None:
    def vessel_of(request: Request) -> str:
        return vessel_at(app_state.warehouse, request.path_params["vessel"])

    def serve(
        path: str, gather: Callable[[Request], Page] | None, document: Callable[[Request], Any] | None = None
    ) -> None:
        if document is not None:  # first: the page's pattern would take its address as well
            app.add_route("/fleet.json" if path == "/" else f"{path}.json", lambda r: _json(document(r)))
        if gather is not None:
            app.add_route(path, lambda r: _shown(r, gather(r)))

    def serve_answer(
        place: str, gather: Callable[[AppState, str, Fields], Page], document: Callable[[AppState, str, Fields], Any]
    ) -> None:
        serve(
            f"/v/{{vessel}}/{place}",
            lambda r: gather(app_state, vessel_of(r), r.query_params),
            lambda r: document(app_state, vessel_of(r), r.query_params),
        )

    def named(key: str) -> Callable[[Request], str]:
        return lambda request: str(request.path_params[key])

    log_id, segment_id, set_id = named("log_id"), named("segment_id"), named("set_id")
    serve("/", lambda r: fleet.gather(app_state), lambda r: fleet.document(app_state))
    serve(
        "/v/{vessel}/ladder",
        lambda r: ladder.gather(app_state, vessel_of(r)),
        lambda r: ladder.document(app_state, vessel_of(r)),
    )
    serve("/v/{vessel}/segments", None, lambda r: vessel.manoeuvres_document(app_state, vessel_of(r)))
    serve("/v/{vessel}/logs", None, lambda r: vessel.logs_document(app_state, vessel_of(r)))
    serve("/v/{vessel}/sets", None, lambda r: vessel.sets_document(app_state, vessel_of(r)))
    serve(
        "/v/{vessel}",
        lambda r: vessel.gather(app_state, vessel_of(r)),
        lambda r: vessel.document(app_state, vessel_of(r)),
    )
    for place, page in (
        ("model", model),
        ("predict", predict),
        ("explain", explain),
        ("what-if", what_if),
        ("next-trial", next_trial),
        ("changes", changes),
    ):
        serve_answer(place, page.gather, page.document)
    serve("/compare", lambda r: compare.gather(app_state, *_both(r)), lambda r: compare.document(app_state, *_both(r)))
    app.add_route("/logs/{log_id}/series", lambda r: _series(app_state, r))
    app.add_route("/segments/{segment_id}/predicted", lambda r: _predicted(app_state, r))
    serve(
        "/logs/{log_id}",
        lambda r: log.gather(app_state, log_id(r), *_window(r)),
        lambda r: log.document(app_state, log_id(r)),
    )
    serve(
        "/segments/{segment_id}",
        lambda r: manoeuvre.gather(app_state, segment_id(r), r.query_params),
        lambda r: manoeuvre.document(app_state, segment_id(r)),
    )
    serve(
        "/sets/{set_id}",
        lambda r: parameter_set.gather(app_state, set_id(r)),
        lambda r: parameter_set.document(app_state, set_id(r)),
    )
    serve(
        "/diagnoses/{name}",
        lambda r: diagnosis.gather(app_state, named("name")(r)),
        lambda r: diagnosis.document(app_state, named("name")(r)),
    )
    serve("/effects", lambda r: effects.gather_list(), lambda r: effects.list_document())
    serve(
        "/effects/{name}",
        lambda r: effects.gather(app_state, named("name")(r)),
        lambda r: effects.document(named("name")(r)),
    )
    app.add_route("/go", lambda r: RedirectResponse(address_of(app_state.warehouse, r.query_params.get("q", "")), 303))


def _serve_jobs(app: FastAPI, app_state: AppState) -> None:
    def shown(request: Request) -> Response:
        return _shown(request, job.gather(app_state, request.path_params["name"]))

    def document(request: Request) -> Response:
        after = whole_number(request.query_params.get("after", "0"))
        return _json(job.document(app_state, request.path_params["name"], after or 0))

    async def ask(request: Request) -> Response:
        form = await _form(request)
        asked = await run_in_threadpool(job.ask, app_state, form)
        return RedirectResponse(job.place_of(asked), 303)

    async def again(request: Request) -> Response:
        asked = await run_in_threadpool(app_state.queue.again, request.path_params["name"])
        return RedirectResponse(f"/jobs/{asked.id}", 303)

    async def take_in(request: Request) -> Response:
        received = await app_state.uploads.receive(request)
        asked = await run_in_threadpool(ingest.ask, app_state, received)
        return RedirectResponse(f"/jobs/{asked.id}", 303)

    async def with_profile(request: Request) -> Response:
        form = await _form(request, _MOST_PROFILE)
        failed = await run_in_threadpool(app_state.queue.get, request.path_params["name"])
        asked = await run_in_threadpool(ingest.ask_with_profile, app_state, failed, form.get("profile", ""))
        return RedirectResponse(f"/jobs/{asked.id}", 303)

    async def note(request: Request) -> Response:
        form = await _form(request)
        return RedirectResponse(await run_in_threadpool(notes.write, app_state, form), 303)

    async def cancel(request: Request) -> Response:
        asked = await run_in_threadpool(app_state.queue.cancel, request.path_params["name"])
        return RedirectResponse(f"/jobs/{asked.id}", 303)

    def report(request: Request) -> Response:
        asked = app_state.queue.get(request.path_params["name"])
        # never shown among the pages: its script is its own
        return FileResponse(reports.of_job(app_state.folder, asked), filename=asked.result["file_name"])

    app.add_route("/jobs/{name}.json", document)
    app.add_route("/jobs/{name}/report", report)
    app.add_route("/jobs/{name}", shown)
    app.add_route("/jobs", lambda r: _shown(r, jobs.gather(app_state)))
    app.add_route("/jobs", ask, methods=["POST"])
    app.add_route("/jobs/{name}/cancel", cancel, methods=["POST"])
    app.add_route("/jobs/{name}/again", again, methods=["POST"])
    app.add_route("/jobs/{name}/profile", with_profile, methods=["POST"])
    app.add_route("/ingest", lambda r: _shown(r, ingest.gather(app_state)))
    app.add_route("/ingest", take_in, methods=["POST"])
    app.add_route("/notes", note, methods=["POST"])


async def _form(request: Request, most: int = _MOST_FORM) -> dict[str, str]:
    """Return the fields of a form; of several of one name the last counts."""
    body = b""
    async for part in request.stream():
        body += part
        if len(body) > most:
            raise UsageError("form_too_long", f"The form has more than {most} bytes.", "Send less.")
    return dict(parse_qsl(body.decode("utf-8", "replace"), keep_blank_values=True))


def _both(request: Request) -> tuple[str, str]:
    return request.query_params.get("a", ""), request.query_params.get("b", "")


def _window(request: Request) -> tuple[str | None, str | None]:
    return request.query_params.get("from"), request.query_params.get("to")


def _series(app_state: AppState, request: Request) -> Response:
    channels = request.query_params.get("ch", "")
    content = series.frame(app_state, request.path_params["log_id"], channels, *_window(request), _bins(request))
    return Response(content, media_type="application/octet-stream")


def _predicted(app_state: AppState, request: Request) -> Response:
    name = request.path_params["segment_id"]
    content = series.predicted_frame(app_state, name, request.query_params, _bins(request))
    return Response(content, media_type="application/octet-stream")


def _bins(request: Request) -> int:
    text = request.query_params.get("bins", "1000")
    bins = whole_number(text)
    if bins is None or not 1 <= bins <= _MOST_BINS:
        raise UsageError(
            "bins_unreadable", f"{text[:40]!r} is no number of bins.", f"Give a whole number from 1 to {_MOST_BINS}."
        )
    return bins


def _shown(request: Request, page: Page) -> Response:
    return HTMLResponse(_html(request, page))


def _html(request: Request, page: Page) -> str:
    return rendered(
        page.template,
        page=page,
        may_write=getattr(request.state, "may_write", False),
        # on every sheet that is printed
        address=str(request.url.remove_query_params("token")),
        today=datetime.now(UTC).date().isoformat(),
        at_work=len(request.app.state.queue.active()),
        **page.content,
    )


def _json(content: Any) -> Response:
    return Response(json_text(content) + "\n", media_type="application/json")


def _refused(request: Request, error: Exception) -> Response:
    """Answer with an error as a page in words, or as the command line's JSON where the address ends so."""
    if isinstance(error, HTTPException):
        error = NotFound(
            "no_page",
            f"There is nothing at the address {request.url.path[:200]!r}.",
            "Go to the fleet's page, or type a name or an id into the field above.",
        )
    failure = wrapped(error)
    if failure.code == "internal":
        traceback.print_exception(failure, file=sys.stderr)
    status = _STATUS_OF_CODE.get(failure.code, _STATUS[failure.exit_code])
    if request.url.path.endswith((".json", "/series", "/predicted")):
        return Response(json_text(failure.as_json()) + "\n", status, media_type="application/json")
    return HTMLResponse(_html(request, error_page.gather(failure, status)), status)
