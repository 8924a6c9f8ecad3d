"""What is stored beside a diagnosis so that its report can be made without computing again: curves, means, parameters.

Everything is SI; angles in radians; what is not known or not finite is NaN here and null in the JSON. Numbers of curves
keep six significant digits.
"""

from __future__ import annotations

from math import isfinite
from typing import Annotated, Any

import numpy as np
from numpy.typing import NDArray
from pydantic import BaseModel, BeforeValidator, ConfigDict, PlainSerializer


def _array(value: Any) -> NDArray[np.float64]:
    return np.asarray(value, dtype=np.float64)


def _nested(value: Any) -> Any:
    if isinstance(value, list):
        return [_nested(item) for item in value]
    return float(f"{value:.6g}") if isfinite(value) else None


#: an array of numbers, of one or two dimensions
Curve = Annotated[
    NDArray[np.float64], BeforeValidator(_array), PlainSerializer(lambda value: _nested(value.tolist()), list[Any])
]
#: a number that may be unknown
Number = Annotated[
    float,
    BeforeValidator(lambda value: float("nan") if value is None else float(value)),
    PlainSerializer(lambda value: value if isfinite(value) else None, float | None),
]


class _Part(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", arbitrary_types_allowed=True)


class FittedParameter(_Part):
    """One parameter of a fitted model."""

    name: str
    unit: str
    #: value, std: And its standard error, in the unit; NaN where a bound is active.
    value: Number
    std: Number


class DisturbanceLevel(_Part):
    """How strong a disturbance a model needs."""

    name: str
    unit: str
    #: Geometric mean over the fitted manoeuvres, in the unit.
    intensity: Number
    #: Of the intensity that the first model needs.
    share: Number


class FittedModel(_Part):
    """One model of the ladder."""

    #: Titles of all its effects, in order.
    effects: tuple[str, ...]
    #: Title of the effect that the model before lacks; empty for the first.
    added: str
    parameters: tuple[FittedParameter, ...]
    #: Those fitted to legs, where predictions with the last model take these; empty elsewhere.
    leg_parameters: tuple[FittedParameter, ...]
    #: fitted_errors, held_out_errors: Shape (runs,). Relative free-run error of each fitted and each held-out
    #: manoeuvre, with ``leg_parameters`` where there are such.
    fitted_errors: Curve
    held_out_errors: Curve
    #: fitted_error, held_out_error: Their means, medians where there are ``leg_parameters``; NaN where there is none,
    #: or a free run diverges.
    fitted_error: Number
    held_out_error: Number
    disturbances: tuple[DisturbanceLevel, ...]
    log_likelihood: Number
    converged: bool


class CandidateEffect(_Part):
    """What the report says of an effect beside the stored verdict on it."""

    #: The manoeuvre or channel that distinguishes it from what looks alike.
    separated_by: str
    #: Canonical channels without which it cannot be tested.
    missing_channels: tuple[str, ...]
    #: Of the confusion set that it was refitted in; empty where it was not, or was refused.
    set_id: str
    #: Its parameters after the refit; empty where ``set_id`` is.
    refitted: tuple[FittedParameter, ...]


class ConfusionMap(_Part):
    """How much of what one effect would explain another would explain alike."""

    titles: tuple[str, ...]
    #: Shape (k, k). 0 to 1.
    squared_cosine: Curve
    #: Above it two effects are put to the same test.
    threshold: float


class AddedVariable(_Part):
    """What is left of the innovations against what an effect would explain, without what fitted parameters imitate."""

    title: str
    #: expected, left: Shape (N,). Standard deviations of the innovation; expected at the size that the score predicts.
    expected: Curve
    left: Curve
    #: score, slope: The slope of ``left`` over ``expected``; 1 is the expected size.
    score: Number
    slope: Number
    #: Half the width of the 95 % interval of the slope.
    slope_half_95: Number
    #: bin_middle, bin_mean, bin_half_95: Shape (b,). Means of ``left`` over bins of ``expected`` that hold equally
    #: many, with half the width of their 95 % interval.
    bin_middle: Curve
    bin_mean: Curve
    bin_half_95: Curve


class Quartiles(_Part):
    """Medians and quartiles over bins of equal width."""

    #: middle, low, median, high: Shape (b,).
    middle: Curve
    low: Curve
    median: Curve
    high: Curve


class UnmodelledPart(_Part):
    """One component of the acceleration beside a model, the mean of each manoeuvre taken off."""

    #: Shape (N,). m/s^2 or rad/s^2.
    values: Curve
    std: Number
    #: By what it is drawn over, see `UnmodelledAcceleration.against`.
    against: dict[str, Quartiles]


class UnmodelledAcceleration(_Part):
    """What acts on the ship beside a model at the instants of all manoeuvres whose free run does not diverge."""

    #: sway, yaw: m/s^2 and rad/s^2.
    sway: UnmodelledPart
    yaw: UnmodelledPart
    #: Shape (N,). ``lateral_speed``, m/s, ``yaw_rate``, ``rudder``, ``heading``, rad.
    against: dict[str, Curve]


class OvershootPair(_Part):
    """One overshoot, measured and predicted in free run, deg; the prediction NaN where the ship does not turn back."""

    #: number, side: Side +1 for starboard.
    number: int
    side: int
    measured_deg: Number
    predicted_deg: Number


class PredictedManoeuvre(_Part):
    """One manoeuvre under one model."""

    #: free_run, free_run_error: Shape (n, 3). Lateral speed, yaw rate, heading as they would be measured, and measured
    #: less that.
    free_run: Curve
    free_run_error: Curve
    #: Shape (n,). Heading of the free run from the base course, rad.
    heading_deviation: Curve
    #: Shape (n, 3). One-step innovations over their standard deviation; NaN where not measured.
    whitened: Curve
    whitened_rms: Number
    #: By horizon in words, then by channel.
    fit_percent: dict[str, dict[str, Number]]
    overshoots: tuple[OvershootPair, ...]


class ManoeuvrePhase(_Part):
    """A phase of a manoeuvre, s from its first instant."""

    name: str
    start_s: float
    end_s: float


class OvershootPeak(_Part):
    """The turning point of an overshoot as it was measured."""

    #: From the first instant of the manoeuvre.
    at_s: float
    #: +1 for starboard.
    side: int
    #: Beyond the nominal heading.
    beyond_deg: float


class ManoeuvreEvidence(_Part):
    """One manoeuvre, measured and predicted by the first model of the ladder and by the last."""

    segment_id: str
    start_utc_ns: int
    held_out: bool
    #: time_s, rudder, speed: Shape (n,). s, rad, m/s.
    time_s: Curve
    rudder: Curve
    speed: Curve
    #: Shape (n, 3). Lateral speed, yaw rate, heading; NaN where there is none.
    measured: Curve
    #: drift, turn: Shape (n,). Lateral speed, m/s, and yaw rate, rad/s, given all measurements; as measured where the
    #: free run diverges.
    drift: Curve
    turn: Curve
    #: Shape (n,). Measured heading from the base course, rad.
    heading_deviation: Curve
    phases: tuple[ManoeuvrePhase, ...]
    peaks: tuple[OvershootPeak, ...]
    #: before, after: Under the first model and the last; ``after`` None where they are the same.
    before: PredictedManoeuvre
    after: PredictedManoeuvre | None


class MisfitPlaces(_Part):
    """Where models fail, as `kempf.pipeline.compare.misfit.where` has it; empty where there is no manoeuvre to say."""

    #: before, after: The first model and the last on fitted manoeuvres.
    before: dict[str, Any]
    after: dict[str, Any]
    #: The last one on held-out manoeuvres.
    held_out: dict[str, Any]


class DiagnosisEvidence(_Part):
    """All that a report shows of a diagnosis beyond its verdict."""

    #: The plain model first.
    models: tuple[FittedModel, ...]
    #: How many of them come before the diagnosed one: it has their effects and one more.
    given: int
    #: By the effect's name.
    candidates: dict[str, CandidateEffect]
    confusion: ConfusionMap
    #: Of the effects that were added; of the strongest candidate where none was.
    added_variables: tuple[AddedVariable, ...]
    #: unmodelled_before, unmodelled_after: Beside the first model and beside the last; ``after`` None where they are
    #: the same.
    unmodelled_before: UnmodelledAcceleration
    unmodelled_after: UnmodelledAcceleration | None
    #: In order of time.
    manoeuvres: tuple[ManoeuvreEvidence, ...]
    #: Lowest and highest of ``drift``, ``turn``, ``rudder`` and ``speed`` over all manoeuvres.
    ranges: dict[str, tuple[Number, Number]]
    misfit: MisfitPlaces
    #: Why a segment was not used, by its id.
    left_out: dict[str, str]

    @property
    def improved(self) -> bool:
        """Whether the last model has more effects than the first."""
        return len(self.models) > 1

    @property
    def found(self) -> bool:
        """Whether the diagnosis added an effect."""
        return len(self.models) > self.given + 1

    @property
    def diagnosed(self) -> FittedModel:
        """The model that the diagnosis began from."""
        return self.models[self.given]

    @property
    def by_legs(self) -> bool:
        """Whether the free runs are with parameters fitted to legs."""
        return any(model.leg_parameters for model in self.models)


def evidence_from_json(text: str) -> DiagnosisEvidence | None:
    """Return evidence from its JSON; None where another version of the code wrote another form."""
    try:
        return DiagnosisEvidence.model_validate_json(text)
    except ValueError:
        return None
