"""Raw logs that a browser sends."""

from __future__ import annotations

from kempf.flows.jobs.ingest.ingest_logs import settle_vessel
from kempf.flows.jobs.state.vessel_state import fleet_state
from kempf.schemas.errors import UsageError
from kempf.warehouse.tables import vessels
from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.jobs.queue import Job
from kempf.workbench.web.pages.page import Page
from kempf.workbench.web.uploads import MOST_BYTES, MOST_FILES, Received, paths_of


def gather(app_state: AppState) -> Page:
    """Return the page that takes logs in."""
    content = {"names": vessels.names(app_state.warehouse), "most_bytes": MOST_BYTES, "most_files": MOST_FILES}
    return Page("ingest.html", "Take logs in", content)


def ask(app_state: AppState, received: Received) -> Job:
    """Put what a browser sent into the queue.

    Raises
    ------
    UsageError
        ``no_file``, ``no_vessel_named``, ``vessel_name``, ``profiles_disagree``.
    NotFound
        ``no_vessel``.
    """
    files, profile = received.files.get("log", []), received.files.get("profile", [])
    if not files:
        raise UsageError("no_file", "No log was sent.", "Choose one or several files, then send the form again.")
    vessel, new = received.fields.get("vessel", "").strip() or None, received.fields.get("new_vessel", "")
    return _queued(app_state, files, profile, vessel, new)


def ask_with_profile(app_state: AppState, failed: Job, text: str) -> Job:
    """Put the logs of a job that failed into the queue again, with a profile that a person corrected on its page.

    Raises
    ------
    UsageError
        ``job_unknown``: the job took no logs in; and what is wrong with the profile.
    """
    if failed.kind != "ingest":
        raise UsageError("job_unknown", f"The job {failed.id} took no logs in.", "Send them from the page that does.")
    profile = app_state.uploads.store_profile(text)
    asked = failed.arguments
    return _queued(app_state, asked["files"], [*asked["profile"], profile], asked["vessel"], asked["new_vessel"])


def _queued(app_state: AppState, files: list[str], profile: list[str], vessel: str | None, new: str) -> Job:
    from kempf.flows.jobs.ingest.files import read_profiles

    profiles = read_profiles(paths_of(app_state.folder, profile)) if profile else None
    # a slip of the hand in the name is said at once
    name, _ = settle_vessel(app_state.warehouse, vessel, profiles, new_vessel=bool(new))
    arguments = {"vessel": name, "files": files, "profile": profile, "new_vessel": new}
    state = fleet_state(app_state.warehouse, [name])[name]
    return app_state.queue.ask("ingest", arguments, state.digest, again=True)
