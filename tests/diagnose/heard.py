"""What a fit reports, kept."""

from __future__ import annotations

from dataclasses import dataclass, field

from kempf.pipeline.estimate.iteration import Iteration


@dataclass
class Heard:
    """A listener that keeps what it hears."""

    pieces: list[str] = field(default_factory=list)
    counts: list[tuple[int, int]] = field(default_factory=list)
    climbs: list[list[Iteration]] = field(default_factory=list)
    ends: list[Iteration] = field(default_factory=list)

    def begins(self, what: str) -> None:
        self.pieces.append(what)

    def counted(self, done: int, total: int) -> None:
        self.counts.append((done, total))

    def iterated(self, iteration: Iteration) -> None:
        if iteration.number == 0:
            self.climbs.append([])
        self.climbs[-1].append(iteration)

    def fitted(self, last: Iteration) -> None:
        self.ends.append(last)
