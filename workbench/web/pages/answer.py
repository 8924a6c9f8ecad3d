"""The answer of a job at a page's address: the page asks by its own fields whether it was made."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from kempf.workbench.web.app_state import AppState
from kempf.workbench.web.jobs.kinds import KINDS
from kempf.workbench.web.jobs.queue import ACTIVE, DONE, Job
from kempf.workbench.web.pages.job import settled


@dataclass(frozen=True)
class PageResult:
    """What a page asks for, and what came of it."""

    #: Arguments of the job, with what the address leaves open.
    arguments: dict[str, Any]
    #: None where nobody asked yet.
    job: Job | None

    @property
    def made(self) -> dict[str, Any] | None:
        """The job's result; None before it is done."""
        return self.job.result if self.job is not None and self.job.state == DONE else None

    @property
    def document(self) -> dict[str, Any] | None:
        """What the command line prints; None before it is made."""
        return None if self.made is None else self.made["document"]

    @property
    def waiting(self) -> Job | None:
        """The job as long as it waits or runs."""
        return self.job if self.job is not None and self.job.state in ACTIVE else None


def answer(app_state: AppState, kind: str, vessel: str, fields: Mapping[str, str]) -> PageResult:
    """Return the answer to the fields of an address; errors are those of `kempf.workbench.web.pages.job.settled`."""
    form = {name: fields.get(name, "") for name in KINDS[kind].fields}
    arguments, digest = settled(app_state, kind, vessel, form)
    return PageResult(arguments, app_state.queue.known(kind, arguments, digest))
