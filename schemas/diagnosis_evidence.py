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
    """One parameter of a fitted model.

    Attributes
    ----------
    name, unit : str
    value, std : float
        And its standard error, in the unit; NaN where a bound is active.
    """

    name: str
    unit: str
    value: Number
    std: Number


class DisturbanceLevel(_Part):
    """How strong a disturbance a model needs.

    Attributes
    ----------
    name, unit : str
    intensity : float
        Geometric mean over the fitted manoeuvres, in the unit.
    share : float
        Of the intensity that the first model needs.
    """

    name: str
    unit: str
    intensity: Number
    share: Number


class FittedModel(_Part):
    """One model of the ladder.

    Attributes
    ----------
    effects : tuple of str
        Titles of all its effects, in order.
    added : str
        Title of the effect that the model before lacks; empty for the first.
    parameters : tuple of FittedParameter
    fitted_errors, held_out_errors : ndarray, shape (runs,)
        Relative free-run error of each fitted and each held-out manoeuvre.
    fitted_error, held_out_error : float
        Their means; NaN where there is none, or a free run diverges.
    disturbances : tuple of DisturbanceLevel
    log_likelihood : float
    converged : bool
    """

    effects: tuple[str, ...]
    added: str
    parameters: tuple[FittedParameter, ...]
    fitted_errors: Curve
    held_out_errors: Curve
    fitted_error: Number
    held_out_error: Number
    disturbances: tuple[DisturbanceLevel, ...]
    log_likelihood: Number
    converged: bool


class CandidateEffect(_Part):
    """What the report says of an effect beside the stored verdict on it.

    Attributes
    ----------
    separated_by : str
        The manoeuvre or channel that distinguishes it from what looks alike.
    missing_channels : tuple of str
        Canonical channels without which it cannot be tested.
    set_id : str
        Of the confusion set that it was refitted in; empty where it was not, or was refused.
    refitted : tuple of FittedParameter
        Its parameters after the refit; empty where ``set_id`` is.
    """

    separated_by: str
    missing_channels: tuple[str, ...]
    set_id: str
    refitted: tuple[FittedParameter, ...]


class ConfusionMap(_Part):
    """How much of what one effect would explain another would explain alike.

    Attributes
    ----------
    titles : tuple of str
    squared_cosine : ndarray, shape (k, k)
        0 to 1.
    threshold : float
        Above it two effects are put to the same test.
    """

    titles: tuple[str, ...]
    squared_cosine: Curve
    threshold: float


class AddedVariable(_Part):
    """What is left of the innovations against what an effect would explain, without what fitted parameters imitate.

    Attributes
    ----------
    title : str
    expected, left : ndarray, shape (N,)
        Standard deviations of the innovation; expected at the size that the score predicts.
    score, slope : float
        The slope of ``left`` over ``expected``; 1 is the expected size.
    slope_half_95 : float
        Half the width of the 95 % interval of the slope.
    bin_middle, bin_mean, bin_half_95 : ndarray, shape (b,)
        Means of ``left`` over bins of ``expected`` that hold equally many, with half the width of their 95 % interval.
    """

    title: str
    expected: Curve
    left: Curve
    score: Number
    slope: Number
    slope_half_95: Number
    bin_middle: Curve
    bin_mean: Curve
    bin_half_95: Curve


class Quartiles(_Part):
    """Medians and quartiles over bins of equal width.

    Attributes
    ----------
    middle, low, median, high : ndarray, shape (b,)
    """

    middle: Curve
    low: Curve
    median: Curve
    high: Curve


class UnmodelledPart(_Part):
    """One component of the acceleration beside a model, the mean of each manoeuvre taken off.

    Attributes
    ----------
    values : ndarray, shape (N,)
        m/s^2 or rad/s^2.
    std : float
    against : mapping of str to Quartiles
        By what it is drawn over, see `UnmodelledAcceleration.against`.
    """

    values: Curve
    std: Number
    against: dict[str, Quartiles]


class UnmodelledAcceleration(_Part):
    """What acts on the ship beside a model at the instants of all manoeuvres whose free run does not diverge.

    Attributes
    ----------
    sway, yaw : UnmodelledPart
        m/s^2 and rad/s^2.
    against : mapping of str to ndarray, shape (N,)
        ``lateral_speed``, m/s, ``yaw_rate``, ``rudder``, ``heading``, rad.
    """

    sway: UnmodelledPart
    yaw: UnmodelledPart
    against: dict[str, Curve]


class OvershootPair(_Part):
    """One overshoot, measured and predicted in free run, deg; the prediction NaN where the ship does not turn back.

    Attributes
    ----------
    number, side : int
        Side +1 for starboard.
    measured_deg, predicted_deg : float
    """

    number: int
    side: int
    measured_deg: Number
    predicted_deg: Number


class PredictedManoeuvre(_Part):
    """One manoeuvre under one model.

    Attributes
    ----------
    free_run, free_run_error : ndarray, shape (n, 3)
        Lateral speed, yaw rate, heading as they would be measured, and measured less that.
    heading_deviation : ndarray, shape (n,)
        Heading of the free run from the base course, rad.
    whitened : ndarray, shape (n, 3)
        One-step innovations over their standard deviation; NaN where not measured.
    whitened_rms : float
    fit_percent : mapping of str to mapping of str to float
        By horizon in words, then by channel.
    overshoots : tuple of OvershootPair
    """

    free_run: Curve
    free_run_error: Curve
    heading_deviation: Curve
    whitened: Curve
    whitened_rms: Number
    fit_percent: dict[str, dict[str, Number]]
    overshoots: tuple[OvershootPair, ...]


class ManoeuvrePhase(_Part):
    """A phase of a manoeuvre, s from its first instant.

    Attributes
    ----------
    name : str
    start_s, end_s : float
    """

    name: str
    start_s: float
    end_s: float


class OvershootPeak(_Part):
    """The turning point of an overshoot as it was measured.

    Attributes
    ----------
    at_s : float
        From the first instant of the manoeuvre.
    side : int
        +1 for starboard.
    beyond_deg : float
        Beyond the nominal heading.
    """

    at_s: float
    side: int
    beyond_deg: float


class ManoeuvreEvidence(_Part):
    """One manoeuvre, measured and predicted by the first model of the ladder and by the last.

    Attributes
    ----------
    segment_id : str
    start_utc_ns : int
    held_out : bool
    time_s, rudder, speed : ndarray, shape (n,)
        s, rad, m/s.
    measured : ndarray, shape (n, 3)
        Lateral speed, yaw rate, heading; NaN where there is none.
    drift, turn : ndarray, shape (n,)
        Lateral speed, m/s, and yaw rate, rad/s, given all measurements; as measured where the free run diverges.
    heading_deviation : ndarray, shape (n,)
        Measured heading from the base course, rad.
    phases : tuple of ManoeuvrePhase
    peaks : tuple of OvershootPeak
    before, after : PredictedManoeuvre
        Under the first model and the last; ``after`` None where they are the same.
    """

    segment_id: str
    start_utc_ns: int
    held_out: bool
    time_s: Curve
    rudder: Curve
    speed: Curve
    measured: Curve
    drift: Curve
    turn: Curve
    heading_deviation: Curve
    phases: tuple[ManoeuvrePhase, ...]
    peaks: tuple[OvershootPeak, ...]
    before: PredictedManoeuvre
    after: PredictedManoeuvre | None


class MisfitPlaces(_Part):
    """Where models fail, as `kempf.pipeline.compare.misfit.where` has it; empty where there is no manoeuvre to say.

    Attributes
    ----------
    before, after : mapping
        The first model and the last on fitted manoeuvres.
    held_out : mapping
        The last one on held-out manoeuvres.
    """

    before: dict[str, Any]
    after: dict[str, Any]
    held_out: dict[str, Any]


class DiagnosisEvidence(_Part):
    """All that a report shows of a diagnosis beyond its verdict.

    Attributes
    ----------
    models : tuple of FittedModel
        The diagnosed model first.
    candidates : mapping of str to CandidateEffect
        By the effect's name.
    confusion : ConfusionMap
    added_variables : tuple of AddedVariable
        Of the effects that were added; of the strongest candidate where none was.
    unmodelled_before, unmodelled_after : UnmodelledAcceleration
        Beside the first model and beside the last; ``after`` None where they are the same.
    manoeuvres : tuple of ManoeuvreEvidence
        In order of time.
    ranges : mapping of str to (float, float)
        Lowest and highest of ``drift``, ``turn``, ``rudder`` and ``speed`` over all manoeuvres.
    misfit : MisfitPlaces
    left_out : mapping of str to str
        Why a segment was not used, by its id.
    """

    models: tuple[FittedModel, ...]
    candidates: dict[str, CandidateEffect]
    confusion: ConfusionMap
    added_variables: tuple[AddedVariable, ...]
    unmodelled_before: UnmodelledAcceleration
    unmodelled_after: UnmodelledAcceleration | None
    manoeuvres: tuple[ManoeuvreEvidence, ...]
    ranges: dict[str, tuple[Number, Number]]
    misfit: MisfitPlaces
    left_out: dict[str, str]

    @property
    def improved(self) -> bool:
        """Whether an effect was added to the first model."""
        return len(self.models) > 1


def evidence_as_json(evidence: DiagnosisEvidence) -> str:
    """Return the evidence as the JSON text that is stored."""
    return evidence.model_dump_json()


def evidence_from_json(text: str) -> DiagnosisEvidence | None:
    """Return what `evidence_as_json` gave; None where another version of the code wrote another form.

    Parameters
    ----------
    text : str
    """
    try:
        return DiagnosisEvidence.model_validate_json(text)
    except ValueError:
        return None
