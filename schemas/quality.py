"""Which findings on logs and models are too many for a night to count as good: the file ``quality.yaml``."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field, ValidationError

from kempf.schemas.errors import UsageError
from kempf.schemas.faults import faults_of
from kempf.schemas.frozen import Frozen

#: What a finding is of, one and several.
FINDINGS = {
    "not_converged": ("parameter set that did not converge", "parameter sets that did not converge"),
    "no_shared_hull": ("model that her manoeuvres do not share", "models that her manoeuvres do not share"),
    "left_out": ("manoeuvre that the pooled set leaves out", "manoeuvres that the pooled set leaves out"),
    "no_zigzag": ("log without a manoeuvre to fit", "logs without a manoeuvre to fit"),
    "missing_channels": (
        "log in which manoeuvres cannot be looked for",
        "logs in which manoeuvres cannot be looked for",
    ),
    "channels": ("log whose channels contradict each other", "logs whose channels contradict each other"),
}
Kind = Literal["not_converged", "no_shared_hull", "left_out", "no_zigzag", "missing_channels", "channels"]


class Limits(Frozen):
    """How many findings of a kind one vessel may have; null is any number."""

    not_converged: int | None = Field(default=None, ge=0)
    no_shared_hull: int | None = Field(default=None, ge=0)
    left_out: int | None = Field(default=None, ge=0)
    no_zigzag: int | None = Field(default=None, ge=0)
    missing_channels: int | None = Field(default=None, ge=0)
    channels: int | None = Field(default=None, ge=0)


class FleetLimits(Limits):
    """The limits of the fleet, and of vessels that differ; what a vessel does not name is as for the fleet."""

    vessels: dict[str, Limits] = Field(default_factory=dict)

    def limit(self, vessel: str, kind: str) -> int | None:
        """Return how many findings of a kind a vessel may have; None: any number."""
        own = self.vessels.get(vessel)
        chosen: Limits = own if own is not None and kind in own.model_fields_set else self
        limit: int | None = getattr(chosen, kind, None)
        return limit


def in_words(kind: str, count: int) -> str:
    """Return how many findings there are of a kind, such as ``2 logs without a manoeuvre to fit``."""
    one, several = FINDINGS[kind]
    return f"{count} {one if count == 1 else several}"


#: any number of findings is allowed
NO_LIMITS = FleetLimits()


def parse(content: Any, where: str) -> FleetLimits:
    """Return the limits that the content of a file states.

    Parameters
    ----------
    where : str
        Name of the file, for the message.

    Raises
    ------
    UsageError
        ``quality_invalid``: every fault is named with its place.
    """
    try:
        return FleetLimits.model_validate({} if content is None else content)
    except ValidationError as error:
        faults = faults_of(error, "file", content)
        raise UsageError(
            "quality_invalid",
            f"{where} does not say how many findings a vessel may have: {'; '.join(faults)}.",
            f"Give a whole number or null for any of {', '.join(n for n in Limits.model_fields)}, and under `vessels` "
            "the same for one vessel.",
            {"path": where, "faults": faults},
        ) from error
