"""What every page works with."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from kempf.warehouse.store import Warehouse
from kempf.workbench.web.data.kept import KeptChannels
from kempf.workbench.web.jobs.queue import Queue
from kempf.workbench.web.uploads import Uploads


@dataclass(frozen=True)
class Desk:
    """A warehouse that is looked at, and what was computed for its pages."""

    warehouse: Warehouse
    #: Folder of jobs and of predictions; to lose it costs time only.
    state: Path
    channels: KeptChannels = field(init=False)
    queue: Queue = field(init=False)
    uploads: Uploads = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "channels", KeptChannels(self.warehouse))
        object.__setattr__(self, "queue", Queue(self.state / "jobs.sqlite"))
        object.__setattr__(self, "uploads", Uploads(self.state / "uploads"))
