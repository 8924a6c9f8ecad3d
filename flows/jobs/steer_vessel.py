"""The job that makes a course-keeping law from a parameter set and tries it on the simulated ship."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from math import degrees, isfinite, nan, radians

from kempf.flows.jobs.chosen_set import chosen_set
from kempf.flows.jobs.ship_model import KnownShip, known_ship
from kempf.flows.jobs.steered_ship import SteeredShip
from kempf.pipeline.model.ship import Hull
from kempf.pipeline.simulate.disturbances import Environment
from kempf.pipeline.simulate.hulls import Hull as SimulatedHull
from kempf.pipeline.simulate.hulls import HullParameters
from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT
from kempf.pipeline.steering.course_keeping import Law, LawSettings, course_law
from kempf.pipeline.steering.robustness import ClosedLoop, closed_loop, share_held
from kempf.pipeline.steering.track import (
    CourseChange,
    Performance,
    Track,
    course_change,
    keep_course,
    performance,
)
from kempf.schemas.errors import UsageError
from kempf.warehouse.store import Warehouse


@dataclass(frozen=True)
class SteerRequest:
    """What is asked for.

    Attributes
    ----------
    set_id : str or None
        Parameter set; None takes the vessel's current one.
    wrong : str or None
        Parameters of a second law: another set's id, or a number by which b1 and b2 are multiplied.
    speed_m_s : float or None
        None takes the set's.
    settings : LawSettings
    environment : Environment
        Wind and stream of the simulated track.
    leg_s, settle_s : float
        Duration of each of the two legs; what is left out at the beginning.
    change_rad : float
        Change of course between the legs.
    seed : int
        Of wind, stream and noise.
    """

    set_id: str | None = None
    wrong: str | None = None
    speed_m_s: float | None = None
    settings: LawSettings = field(default_factory=LawSettings)
    environment: Environment = PAPER_ENVIRONMENT
    leg_s: float = 1200.0
    settle_s: float = 300.0
    change_rad: float = radians(10.0)
    seed: int = 0


@dataclass(frozen=True, eq=False)
class Tried:
    """A law and what came of it.

    Attributes
    ----------
    label : str
        Whose parameters it was made from.
    hull : Hull
        Them.
    law : Law
    track : Track
    performance : Performance
        On the first leg, without its beginning.
    change : CourseChange
    loop : ClosedLoop
        On the ship of the parameter set, without rudder rate and limit.
    held : float
        Share of the ships that the covariance of the set allows which it keeps stable; NaN without a covariance.
    """

    label: str
    hull: Hull
    law: Law
    track: Track
    performance: Performance
    change: CourseChange
    loop: ClosedLoop
    held: float


@dataclass(frozen=True, eq=False)
class Steered:
    """What the job did.

    Attributes
    ----------
    ship : KnownShip
    request : SteerRequest
    laws : tuple of Tried
        From the set's own parameters, then from the wrong ones if any were asked for.
    warnings : tuple of str
    """

    ship: KnownShip
    request: SteerRequest
    laws: tuple[Tried, ...]
    warnings: tuple[str, ...]


def steer_vessel(warehouse: Warehouse, vessel: str, request: SteerRequest = SteerRequest()) -> Steered:
    """Make course-keeping laws and try them on one simulated ship in the same weather.

    The ship that is steered has the parameters of the set; what she really is nobody knows.

    Parameters
    ----------
    warehouse : Warehouse
    vessel : str
    request : SteerRequest, optional

    Returns
    -------
    Steered

    Raises
    ------
    NotFound
        There is no such vessel or set.
    UsageError
        The set is another vessel's, or a number is out of range.
    DataRejected
        No law follows from the parameters.
    """
    if not (isfinite(request.leg_s) and request.leg_s > request.settle_s + 60.0):
        raise UsageError(
            "track_too_short",
            f"A leg of {request.leg_s:g} s leaves too little after the first {request.settle_s:g} s to settle.",
            "Ask for legs that are more than a minute longer.",
        )
    one, _ = chosen_set(warehouse, vessel, request.set_id)
    ship = known_ship(warehouse, one.parameter_set_id, request.speed_m_s)
    wanted = [(one.parameter_set_id, ship.hull)]
    if request.wrong is not None:
        wanted.append(_wrong(warehouse, request.wrong, ship))
    laws = tuple(_tried(label, hull, ship, request) for label, hull in wanted)
    warnings = list(ship.warnings)
    needed = abs(laws[0].law.rudder_per_force * request.environment.wind_force.mean)
    if needed > 0.8 * request.settings.rudder_limit_rad:
        warnings.append(
            f"the steady wind of the track needs {degrees(needed):.0f} deg of rudder, of "
            f"{degrees(request.settings.rudder_limit_rad):.0f} deg that there are"
        )
    return Steered(ship, request, laws, tuple(warnings))


def _wrong(warehouse: Warehouse, wrong: str, ship: KnownShip) -> tuple[str, Hull]:
    try:
        factor = float(wrong)
    except ValueError:
        other = known_ship(warehouse, wrong, ship.speed_m_s)
        return f"{other.parameter_set.parameter_set_id} ({other.parameter_set.vessel})", other.hull
    if not (isfinite(factor) and factor > 0.0):
        raise UsageError("wrong_factor", f"The factor is {wrong}, expected more than 0.", "Give 0.5 or 2, say.")
    hull = replace(ship.hull, b1=factor * ship.hull.b1, b2=factor * ship.hull.b2)
    return f"rudder taken for {factor:g} times as effective", hull


def _tried(label: str, hull: Hull, ship: KnownShip, request: SteerRequest) -> Tried:
    law = course_law(
        hull,
        ship.speed_m_s,
        arm_per_m=ship.arm_per_m,
        spec=ship.spec,
        noise=ship.noise,
        settings=request.settings,
    )
    simulated = simulated_hull(ship, request.settings)
    longest = 2.0 * request.leg_s + 2.0 * law.step_s
    steered = SteeredShip(simulated, request.environment, longest, seed=request.seed)
    track = keep_course(steered, law, 2.0 * request.leg_s, 0.0, ((request.leg_s, request.change_rad),))
    change = course_change(track)
    assert change is not None
    return Tried(
        label,
        hull,
        law,
        track,
        performance(track, request.settle_s, request.leg_s),
        change,
        closed_loop(law, ship.hull, ship.speed_m_s),
        share_held(law, ship.hull, ship.covariance, ship.speed_m_s),
    )


def simulated_hull(ship: KnownShip, settings: LawSettings) -> SimulatedHull:
    """Return the ship of a parameter set as the simulator takes her; without a length her speed stays constant."""
    parameters = HullParameters(*(float(x) for x in ship.hull.array()))
    return SimulatedHull(
        ship.parameter_set.vessel,
        ship.parameter_set.parameter_set_id,
        parameters,
        length_m=ship.length_m or 1.0,
        beam_m=nan,
        draught_m=nan,
        block_coefficient=nan,
        trial_speed_m_s=ship.speed_m_s,
        wind_arm_per_m=ship.arm_per_m,
        rudder_rate_rad_s=settings.rudder_rate_rad_s,
        rudder_limit_rad=settings.rudder_limit_rad,
        speed_loss=0.3 if ship.length_m else 0.0,
        surge_time_lengths=6.0 if ship.length_m else 60.0 * ship.speed_m_s,
    )
