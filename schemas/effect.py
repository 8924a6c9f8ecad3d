"""What an effect is: formulas, parameters with bounds, and words for the user.

The catalogue's files (`schemas/effects`) and a user's own are all of this form; no code in them is ever run.
"""

from __future__ import annotations

import hashlib
import json
import math
import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal

from pydantic import Field, StringConstraints, ValidationInfo, field_validator, model_validator

from kempf.schemas.frozen import Frozen
from kempf.schemas.symbols import CHANNEL_SYMBOLS, LOGGED_CHANNELS, OWN_STATES, TARGETS

Group = Literal["hull", "rudder", "propulsion", "environment", "sensor", "other", "own"]
#: what may become of the rudder's course before it reaches the hull: compiled code, `pipeline/model/effects`
RudderCourse = Literal["backlash", "dead_time", "rate_limit", "rudder_lag"]

_Line = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=500)]
_Words = Annotated[str, StringConstraints(strip_whitespace=True, max_length=500)]
_Formula = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=4000)]
_PARAMETER = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,19}")
_WORD = re.compile(r"[A-Za-z_]\w*")


class Parameter(Frozen):
    """One number of an effect.

    Either it makes the effect, which is absent with 0, or it shapes what others make, such as a frequency: then 0 lies
    outside its bounds.
    """

    name: str
    unit: str = Field(default="", max_length=40)
    #: low, high: Bounds that are physical.
    low: float
    high: float
    #: Values at which the effect is tried. One is enough for what goes linearly with the parameter; a threshold
    #: (backlash, dead time) needs several.
    steps: tuple[float, ...] = Field(min_length=1, max_length=9)
    meaning: _Words = ""

    @model_validator(mode="after")
    def _sound(self) -> Parameter:
        if not _PARAMETER.fullmatch(self.name):
            raise ValueError(f"{self.name[:40]!r} is no name of a parameter: take letters, digits and underscores")
        if not self.low < self.high:
            raise ValueError(f"low must be less than high; they are {self.low:g} and {self.high:g}")
        outside = [step for step in self.steps if step == 0.0 or not self.low <= step <= self.high]
        if outside:
            raise ValueError(f"the step {outside[0]:g} must not be 0 and must lie between low and high")
        return self

    @property
    def shapes(self) -> bool:
        """Whether it shapes the effect and does not make it."""
        return not self.low <= 0.0 <= self.high

    @property
    def is_direction(self) -> bool:
        """Whether it is a direction, of which whole turns do not count: its bounds are more than one apart."""
        return self.unit == "rad" and self.high - self.low > 2.0 * math.pi

    @property
    def absent(self) -> float:
        """Its value where the effect is absent: 0, or any where it only shapes."""
        return self.steps[0] if self.shapes else 0.0


class ExtraState(Frozen):
    """A state that an effect brings along, such as a memory of the sway: all three are formulas."""

    #: ``m1`` to ``m4``.
    name: str
    #: Of time.
    derivative: _Formula
    #: Intensity of the white noise that drives it.
    noise: _Formula = "0"
    #: Standard deviation at the first instant.
    initial_std: _Formula = "0"


class Effect(Frozen):
    """One physical effect that eq. (16) lacks."""

    #: name, title: The key, and how it is called in a sentence.
    name: _Line
    title: _Line = ""
    group: Group = "own"
    #: What it does, for a naval architect: one sentence without symbols.
    plain: _Line
    equation: str = ""
    reference: _Line
    parameters: tuple[Parameter, ...] = Field(min_length=1, max_length=9)
    #: Formula by target, see `kempf.schemas.symbols.TARGETS`.
    terms: dict[str, _Formula] = Field(default_factory=dict, max_length=len(TARGETS))
    #: What becomes of the rudder's course before it reaches the hull; the first parameter is its size.
    rudder_course: RudderCourse | None = None
    states: tuple[ExtraState, ...] = Field(default=(), max_length=len(OWN_STATES))
    #: Canonical channels without which it cannot be tested: those that its formulas speak of, and any that are named.
    needs: tuple[_Line, ...] = Field(default=(), validate_default=True)
    #: Canonical channels that show it already: where every run has one of them there is nothing left to look for.
    measured_by: tuple[_Line, ...] = ()
    #: Whether it is a term of a series in drift and turn: it fits what was sailed, and says nothing beyond that.
    polynomial: bool = False
    #: confounded_with, separated_by: What looks alike, and the manoeuvre or channel that distinguishes the two.
    confounded_with: _Words = ""
    separated_by: _Words = ""

    @model_validator(mode="before")
    @classmethod
    def _with_words(cls, content: Any) -> Any:
        """Make the words that a file may leave out from the rest."""
        if not isinstance(content, dict):
            return content
        terms = content.get("terms")
        written = "; ".join(f"{k}: {v}" for k, v in terms.items()) if isinstance(terms, dict) else ""
        return {"title": str(content.get("name") or "-").replace("_", " "), "equation": written, **content}

    @field_validator("parameters", "states", mode="before")
    @classmethod
    def _by_name(cls, entries: Any) -> Any:
        """Take a mapping by name, as a file has it."""
        if not isinstance(entries, dict):
            return entries
        return tuple({**e, "name": n} if isinstance(e, dict) else {"name": n} for n, e in entries.items())

    @field_validator("parameters")
    @classmethod
    def _first_makes_it(cls, parameters: tuple[Parameter, ...]) -> tuple[Parameter, ...]:
        if parameters[0].shapes:
            raise ValueError(
                f"0 must lie between low and high of {parameters[0].name}, the first parameter: it makes the effect"
            )
        return parameters

    @field_validator("states")
    @classmethod
    def _numbered(cls, states: tuple[ExtraState, ...]) -> tuple[ExtraState, ...]:
        if tuple(state.name for state in states) != OWN_STATES[: len(states)]:
            raise ValueError(f"states are numbered through, {', '.join(OWN_STATES)}; found {states[0].name[:40]!r}")
        return states

    @field_validator("needs")
    @classmethod
    def _spoken_of(cls, named: tuple[str, ...], others: ValidationInfo) -> tuple[str, ...]:
        """Add the channels that the formulas speak of."""
        strange = [channel for channel in named if channel not in CHANNEL_SYMBOLS.values()]
        if strange:
            raise ValueError(f"take {', '.join(CHANNEL_SYMBOLS.values())}; found {strange[0][:40]!r}")
        words = _words_in(others.data.get("terms", {}), others.data.get("states", ()))
        return tuple(dict.fromkeys([*(c for symbol, c in CHANNEL_SYMBOLS.items() if symbol in words), *named]))

    @field_validator("measured_by")
    @classmethod
    def _logged(cls, named: tuple[str, ...]) -> tuple[str, ...]:
        strange = [channel for channel in named if channel not in LOGGED_CHANNELS]
        if strange:
            raise ValueError(f"take {', '.join(LOGGED_CHANNELS)}; found {strange[0][:40]!r}")
        return named

    @model_validator(mode="after")
    def _acts(self) -> Effect:
        for target in self.terms:
            if target not in TARGETS:
                raise ValueError(f"terms act on {', '.join(TARGETS)}; found {target[:40]!r}")
        if not self.terms and self.rudder_course is None:
            raise ValueError("it has no term: give it terms or a rudder_course")
        return self

    def uses(self, symbol: str) -> bool:
        """Return whether its formulas speak of a symbol, see `kempf.schemas.symbols.SYMBOLS`."""
        return symbol in _words_in(self.terms, self.states)

    @property
    def sha256(self) -> str:
        """Hash of what the effect computes, by which a model's provenance pins it.

        The words about it are left out: a better sentence makes no other model. A rudder course counts by its name, and
        its code with the rest of the code.
        """
        content = {
            "name": self.name,
            "parameters": [[p.name, p.unit, p.low, p.high, list(p.steps)] for p in self.parameters],
            "terms": sorted(self.terms.items()),
            "states": [[s.name, s.derivative, s.noise, s.initial_std] for s in self.states],
            "needs": list(self.needs),
            "rudder_course": self.rudder_course,
        }
        if self.measured_by:
            # by the key's first name, so that the models that hold such an effect keep theirs
            content["told_by"] = list(self.measured_by)
        return hashlib.sha256(json.dumps(content, sort_keys=True, separators=(",", ":")).encode()).hexdigest()

    def as_json(self) -> dict[str, Any]:
        """Return all fields as JSON content, and the hash.

        ``rudder_course`` says whether there is one; ``told_by`` is the old name of ``measured_by``.
        """
        return {
            **self.model_dump(mode="json"),
            "rudder_course": self.rudder_course is not None,
            "told_by": list(self.measured_by),
            "sha256": self.sha256,
        }


def _words_in(terms: Mapping[str, str], states: Sequence[ExtraState]) -> set[str]:
    formulas = (*terms.values(), *(formula for state in states for formula in (state.derivative, state.noise)))
    return {word for formula in formulas for word in _WORD.findall(formula)}
