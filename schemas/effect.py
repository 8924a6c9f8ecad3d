"""The effect file: an effect of a person's own as YAML, no code in it."""

from __future__ import annotations

import re
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, model_validator

_Line = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=500)]
_Formula = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=4000)]
_NAME = re.compile(r"[A-Za-z][A-Za-z0-9_]{0,19}")


class _Frozen(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


class ParameterEntry(_Frozen):
    """One number of the effect: 0 is where it is absent, or lies outside the bounds of what only shapes it."""

    unit: str = Field(default="", max_length=40)
    #: bounds that are physical
    low: float
    high: float
    #: values at which the effect is tried; one, unless it has a threshold
    steps: tuple[float, ...] = Field(min_length=1, max_length=9)
    meaning: str = Field(default="", max_length=500)

    @model_validator(mode="after")
    def _ordered(self) -> ParameterEntry:
        if not self.low < self.high:
            raise ValueError(f"low must be less than high; they are {self.low:g} and {self.high:g}")
        outside = [step for step in self.steps if step == 0.0 or not self.low <= step <= self.high]
        if outside:
            raise ValueError(f"the step {outside[0]:g} must not be 0 and must lie between low and high")
        return self


class StateEntry(_Frozen):
    """A state that the effect brings along: a formula each."""

    derivative: _Formula
    noise: _Formula = "0"
    initial_std: _Formula = "0"


class EffectFile(_Frozen):
    """What an effect file says."""

    name: _Line
    title: _Line | None = None
    #: what it does, one sentence for a naval architect
    plain: _Line
    #: formula by what it acts on
    terms: dict[str, _Formula] = Field(min_length=1, max_length=7)
    parameters: dict[str, ParameterEntry] = Field(min_length=1, max_length=9)
    #: m1 to m4
    states: dict[str, StateEntry] = Field(default_factory=dict, max_length=4)
    #: canonical channels without which it cannot be tested, beside those its formulas speak of
    needs: tuple[_Line, ...] = ()
    equation: _Line | None = None
    reference: _Line
    confounded_with: str = Field(default="", max_length=500)
    separated_by: str = Field(default="", max_length=500)

    @model_validator(mode="after")
    def _named(self) -> EffectFile:
        for name in self.parameters:
            if not _NAME.fullmatch(name):
                raise ValueError(f"{name[:40]!r} is no name of a parameter: take letters, digits and underscores")
        first, entry = next(iter(self.parameters.items()))
        if not entry.low <= 0.0 <= entry.high:
            raise ValueError(
                f"0 must lie between low and high of {first[:40]}, the first parameter: it makes the effect"
            )
        strange = [name for name in self.states if name not in ("m1", "m2", "m3", "m4")]
        if strange:
            raise ValueError(f"states are called m1, m2, m3, m4; found {strange[0][:40]!r}")
        if list(self.states) != ["m1", "m2", "m3", "m4"][: len(self.states)]:
            raise ValueError("states are numbered through: m1, then m2")
        return self
