"""What an effect is: terms, what it does to the rudder, its parameters with bounds, and plain words for the user."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from kempf.pipeline.channels.series import Float
from kempf.pipeline.model.terms.symbols import CHANNEL_SYMBOLS, TARGETS, TELLING
from kempf.schemas.errors import UsageError

Group = Literal["hull", "rudder", "propulsion", "environment", "sensor", "other", "own"]
#: (time in s, rudder in rad, parameters) -> rudder in rad that the hull feels; the times are evenly spaced
RudderCourse = Callable[[Float, Float, Float], Float]


@dataclass(frozen=True)
class Parameter:
    """One number of an effect.

    Either it makes the effect, which is absent with 0, or it shapes what others make, such as a frequency: then 0 lies
    outside its bounds.

    Attributes
    ----------
    name, unit, meaning : str
    low, high : float
        Bounds that are physical.
    steps : tuple of float
        Values at which the effect is tried. One is enough for what goes linearly with the parameter; a threshold
        (backlash, dead time) needs several.
    """

    name: str
    unit: str
    low: float
    high: float
    steps: tuple[float, ...]
    meaning: str

    @property
    def shapes(self) -> bool:
        """Whether it shapes the effect and does not make it."""
        return not self.low <= 0.0 <= self.high

    @property
    def absent(self) -> float:
        """Its value where the effect is absent: 0, or any where it only shapes."""
        return self.steps[0] if self.shapes else 0.0


@dataclass(frozen=True)
class ExtraState:
    """A state that an effect brings along, such as a memory of the sway: all three are expressions.

    Attributes
    ----------
    name : str
        ``m1`` to ``m4``.
    derivative : str
        Of time.
    noise : str
        Intensity of the white noise that drives it.
    initial_std : str
        Standard deviation at the first instant.
    """

    name: str
    derivative: str
    noise: str = "0"
    initial_std: str = "0"


@dataclass(frozen=True)
class Effect:
    """One physical effect that eq. (16) lacks.

    Attributes
    ----------
    name, title : str
        The key, and how it is called in a sentence.
    group : str
    plain : str
        What it does, for a naval architect: one sentence without symbols.
    equation, reference : str
    parameters : tuple of Parameter
    terms : mapping of str to str
        Expression by target, see `kempf.pipeline.model.terms.symbols.TARGETS`.
    rudder_course : callable, optional
        What becomes of the rudder's course before it reaches the hull.
    states : tuple of ExtraState
    needs : tuple of str
        Canonical channels without which it cannot be tested.
    told_by : tuple of str
        Canonical channels that show it already: where every run has one of them there is nothing left to look for.
    confounded_with, separated_by : str
        What looks alike, and the manoeuvre or channel that tells them apart.
    """

    name: str
    title: str
    group: Group
    plain: str
    equation: str
    reference: str
    parameters: tuple[Parameter, ...]
    terms: Mapping[str, str] = field(default_factory=dict)
    rudder_course: RudderCourse | None = None
    states: tuple[ExtraState, ...] = ()
    needs: tuple[str, ...] = ()
    told_by: tuple[str, ...] = ()
    confounded_with: str = ""
    separated_by: str = ""

    def __post_init__(self) -> None:
        unknown = [target for target in self.terms if target not in TARGETS]
        if unknown:
            raise UsageError(
                "effect_target",
                f"The effect {self.name!r} acts on {unknown[0]!r}; known are {', '.join(TARGETS)}.",
                "Name one of these before the colon.",
            )
        if not self.terms and self.rudder_course is None:
            raise UsageError(
                "effect_empty", f"The effect {self.name!r} has no term.", "Give it terms or a rudder_course."
            )
        lost = [channel for channel in self.needs if channel not in CHANNEL_SYMBOLS.values()]
        if lost:
            raise UsageError(
                "effect_channel",
                f"The effect {self.name!r} needs the channel {lost[0]!r}, which no symbol stands for.",
                f"Use one of {', '.join(CHANNEL_SYMBOLS.values())}.",
            )
        strange = [channel for channel in self.told_by if channel not in TELLING]
        if strange:
            raise UsageError(
                "effect_channel",
                f"The effect {self.name!r} is told by the channel {strange[0]!r}, which runs do not list.",
                f"Use one of {', '.join(TELLING)}.",
            )
