"""What a run at the information limit gives, and what the runs of one cell say together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.pipeline.estimate.uncertainty import from_information
from kempf.schemas.confidence import NORMAL_95


@dataclass(frozen=True)
class Case:
    """One cell: a ship, a factor on all measurement noise, what acts on her, and what is measured."""

    hull: str
    scale: float
    environment: str = "paper"
    with_heading: bool = True
    control: str = ""

    @property
    def on_grid(self) -> bool:
        """Whether it is one of the hulls and noise levels in the paper's wind and stream, nothing else changed."""
        return self.environment == "paper" and self.with_heading and not self.control

    @property
    def share(self) -> int:
        """How many times fewer runs it gets than a cell of the grid."""
        if self.on_grid:
            return 1
        return 4 if not self.with_heading or self.control == "forgetting" else 8


@dataclass(frozen=True, eq=False)
class Run:
    """One run: estimate, reported standard errors, truth, information at the truth; or why there is none."""

    case: Case
    number: int
    value: Float = field(default_factory=lambda: np.empty(0))
    std: Float = field(default_factory=lambda: np.empty(0))
    truth: Float = field(default_factory=lambda: np.empty(0))
    information: Float = field(default_factory=lambda: np.empty((0, 0)))
    free: NDArray[np.bool_] = field(default_factory=lambda: np.empty(0, dtype=np.bool_))
    levels: dict[str, float] = field(default_factory=dict)
    converged: bool = False
    widened: bool = False
    gross: int = 0
    failure: str = ""

    @property
    def usable(self) -> bool:
        """Whether it ended at a maximum with standard errors."""
        return self.converged and self.std.size > 0 and bool(np.all(np.isfinite(self.std)))


@dataclass(frozen=True, eq=False)
class Cell:
    """The usable runs of one cell together; arrays have shape (6,) and are relative to the true parameters."""

    case: Case
    #: runs, failures: All of them, and those without an estimate, not converged, or without standard errors.
    runs: int
    failures: int
    #: Shape (n, 6). Errors in reported standard errors.
    z: Float
    #: rms, bias: Of the errors.
    rms: Float
    bias: Float
    #: bound, own: Cramer-Rao bound at the truth, and the root mean square of the reported standard errors.
    bound: Float
    own: Float
    #: Runs whose standard errors are those of the sandwich.
    widened: int
    #: Median estimated noise levels.
    levels: dict[str, float]

    @property
    def covered(self) -> Float:
        """Share of the runs whose 95 % interval holds the truth, shape (6,)."""
        share: Float = np.mean(np.abs(self.z) <= NORMAL_95, axis=0)
        return share


def bound_of(information: Float, free: NDArray[np.bool_]) -> Float:
    """Return the Cramer-Rao bound of the six hull parameters, the free noise levels unknown, shape (6,)."""
    covariance = from_information(information, np.flatnonzero(free)).covariance
    bound: Float = np.sqrt(np.diag(covariance)[:6])
    return bound


def gather(runs: Sequence[Run]) -> Cell:
    """Put the runs of one cell together."""
    good = [r for r in runs if r.usable]
    truth = good[0].truth
    error = np.array([r.value - r.truth for r in good])
    std = np.array([r.std for r in good])
    bounded = [r for r in good if r.information.size]
    information = np.mean([r.information for r in bounded], axis=0)
    scale = np.abs(truth)
    names = sorted({name for r in good for name in r.levels})
    return Cell(
        case=good[0].case,
        runs=len(runs),
        failures=len(runs) - len(good),
        z=error / std,
        rms=np.sqrt(np.mean(error**2, axis=0)) / scale,
        bias=np.mean(error, axis=0) / scale,
        bound=bound_of(information, bounded[0].free) / scale,
        own=np.sqrt(np.mean(std**2, axis=0)) / scale,
        widened=sum(r.widened for r in good),
        levels={name: float(np.median([r.levels[name] for r in good if name in r.levels])) for name in names},
    )
