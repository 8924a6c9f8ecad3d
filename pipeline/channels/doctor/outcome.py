"""What a check says: the channels agree, they disagree, or these data cannot show which."""

from __future__ import annotations

from dataclasses import dataclass, field
from math import isfinite
from typing import Literal

from kempf.pipeline.channels.doctor.faults import Fault

State = Literal["agree", "disagree", "untestable"]

#: How many standard errors outside what is expected a figure must lie: one in 16,000 by chance, a dozen figures a log
SURE = 4.0
#: The same for a figure too uncertain to be sure of: it is doubtful.
DOUBTFUL = 2.0
#: Why motions are not compared where there is none.
STILL = "she does not move: not testable"


@dataclass(frozen=True)
class CheckFigure:
    """One measured figure of a check and what is expected of it."""

    name: str
    #: value, std: With the standard error, what is unknown of current and leeway included.
    value: float
    std: float
    #: low, high: What sound channels give, their ordinary errors included.
    low: float
    high: float
    unit: str = "1"

    @property
    def outside(self) -> float:
        """By how many standard errors the figure lies outside what is expected; 0 within."""
        beyond = max(self.low - self.value, self.value - self.high, 0.0)
        return 0.0 if beyond == 0.0 else beyond / max(self.std, 1e-12)

    @property
    def state(self) -> State:
        """Outside beyond doubt, within, or too uncertain to have shown a fault."""
        if not (isfinite(self.value) and isfinite(self.std)):
            return "untestable"
        if self.outside > SURE:
            return "disagree"
        # a figure that could not have left the band unless it were absurd has tested nothing
        return (
            "agree"
            if SURE * self.std <= max(self.high - self.low, 1e-12) * 2.0 and self.outside <= SURE
            else "untestable"
        )


@dataclass(frozen=True)
class Outcome:
    """What one check says of a log."""

    #: Its name, such as ``heading_rate``.
    check: str
    #: That it compares.
    channels: tuple[str, ...]
    #: One of {"agree", "disagree", "untestable"}.
    state: State
    #: One sentence with the evidence.
    words: str
    figures: tuple[CheckFigure, ...] = ()
    #: Size of what does not go together over the size of what there is; shows which of two corrections fits better.
    left_over: float = 0.0
    #: What could have caused a disagreement.
    suspects: tuple[Fault, ...] = field(default=(), repr=False)
    #: What it says where it disagrees and no correction of a channel is known; empty for a comparison of channels.
    claim: str = ""
    #: Whether length and speed do not belong together: then no other check is to use the length.
    distrusts_length: bool = False
    #: Whether no two channels were compared: then agreement confirms nothing.
    alone: bool = False

    @property
    def consistent(self) -> bool:
        """Whether it agrees, or every figure lies where it should, though too uncertain to have shown a fault."""
        within = bool(self.figures) and all(figure.outside <= DOUBTFUL for figure in self.figures)
        return self.state == "agree" or (self.state == "untestable" and within)

    @property
    def doubtful(self) -> bool:
        """Whether a figure lies well outside what is expected, and no figure is sure to."""
        return self.state != "disagree" and any(figure.outside > DOUBTFUL for figure in self.figures)


def untestable(check: str, channels: tuple[str, ...], why: str) -> Outcome:
    """Return the outcome of a check that these data cannot answer."""
    return Outcome(check, channels, "untestable", why)


def worst(states: list[State]) -> State:
    """Return what several figures say together: one that disagrees decides, else one that tested something."""
    ordered: tuple[State, State] = ("disagree", "agree")
    for state in ordered:
        if state in states:
            return state
    return "untestable"
