"""What every page works with."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

from kempf.warehouse.storage.store import Warehouse
from kempf.workbench.web.data.channel_cache import ChannelCache
from kempf.workbench.web.jobs.queue import Queue
from kempf.workbench.web.uploads import Uploads


@dataclass(frozen=True)
class AppState:
    """A warehouse that is looked at, and what was computed for its pages."""

    warehouse: Warehouse
    #: Folder of jobs and of predictions; to lose it costs time only.
    folder: Path
    channels: ChannelCache = field(init=False)
    queue: Queue = field(init=False)
    uploads: Uploads = field(init=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "channels", ChannelCache(self.warehouse))
        object.__setattr__(self, "queue", Queue(self.folder / "jobs.sqlite"))
        object.__setattr__(self, "uploads", Uploads(self.folder / "uploads"))
