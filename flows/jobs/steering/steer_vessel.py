"""The job that makes a course-keeping law from a parameter set and tries it on the simulated ship."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from math import degrees, isfinite, nan, radians

import numpy as np

from kempf.flows.jobs.identify.chosen_set import chosen_set, named_set
from kempf.flows.jobs.identify.ship_model import ShipOfSet, ship_of_set
from kempf.flows.jobs.steering.steered_ship import SteeredShip
from kempf.pipeline.model.ship import Hull
from kempf.pipeline.simulate.disturbances import Environment
from kempf.pipeline.simulate.hulls import HullParameters, SimulatedHull
from kempf.pipeline.simulate.steering_gear import DeadTime, GearPart, Lag, Play, RateLimit, SteeringGear
from kempf.pipeline.simulate.trial import PAPER_ENVIRONMENT
from kempf.pipeline.steering.carried import Carried, carried
from kempf.pipeline.steering.course_keeping import Law, LawSettings, course_law
from kempf.pipeline.steering.motion import ShipEffects, equivalent_hull, linear_motion
from kempf.pipeline.steering.robustness import ClosedLoop, closed_loop, share_held
from kempf.pipeline.steering.track import (
    CourseChangeResponse,
    Performance,
    Track,
    course_change,
    keep_course,
    performance,
)
from kempf.schemas.errors import UsageError
from kempf.warehouse.storage.store import Warehouse


@dataclass(frozen=True)
class SteerRequest:
    """What is asked for."""

    #: Parameter set; None takes the vessel's current one.
    set_id: str | None = None
    #: Parameters of a second law: another set's id, or a number by which b1 and b2 are multiplied.
    wrong: str | None = None
    #: None takes the set's.
    speed_m_s: float | None = None
    settings: LawSettings = field(default_factory=LawSettings)
    #: Wind and stream of the simulated track.
    environment: Environment = PAPER_ENVIRONMENT
    #: leg_s, settle_s: Duration of each of the two legs; what is left out at the beginning.
    leg_s: float = 1200.0
    settle_s: float = 300.0
    #: Change of course between the legs.
    change_rad: float = radians(10.0)
    #: Of wind, stream and noise.
    seed: int = 0


@dataclass(frozen=True, eq=False)
class TriedLaw:
    """A law and what came of it."""

    #: Whose parameters it was made from.
    label: str
    #: Them.
    hull: Hull
    law: Law
    track: Track
    #: On the first leg, without its beginning.
    performance: Performance
    change: CourseChangeResponse
    #: On the ship of the parameter set, without rudder rate and limit.
    loop: ClosedLoop
    #: Share of the ships that the covariance of the set allows which it keeps stable; NaN without a covariance.
    held: float


@dataclass(frozen=True, eq=False)
class Steered:
    """What the job did."""

    ship: ShipOfSet
    request: SteerRequest
    #: From the set's own parameters, then from the wrong ones if any were asked for.
    laws: tuple[TriedLaw, ...]
    warnings: tuple[str, ...]


def steer_vessel(warehouse: Warehouse, vessel: str, request: SteerRequest = SteerRequest()) -> Steered:
    """Make course-keeping laws and try them on one simulated ship in the same weather.

    The ship that is steered has the parameters of the set, and of its effects what the simulator can do; what she
    really is nobody knows. Her instruments read right, so effects on measurements are in neither law nor ship.

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
    parameter_set, _ = chosen_set(warehouse, vessel, request.set_id)
    ship, dropped = _with_right_instruments(ship_of_set(warehouse, parameter_set, request.speed_m_s))
    designs = [(parameter_set.parameter_set_id, ship.hull, ship.effects)]
    if request.wrong is not None:
        designs.append(_wrong(warehouse, request.wrong, ship))
    laws = tuple(_tried(*design, ship, request) for design in designs)
    warnings = [*ship.warnings, *dropped, *_not_simulated(ship, dropped)]
    needed = abs(laws[0].law.rudder_per_force * request.environment.wind_force.mean)
    if needed > 0.8 * request.settings.rudder_limit_rad:
        warnings.append(
            f"the steady wind of the track needs {degrees(needed):.0f} deg of rudder, of "
            f"{degrees(request.settings.rudder_limit_rad):.0f} deg that there are"
        )
    return Steered(ship, request, laws, tuple(warnings))


def _on_instruments(effects: ShipEffects | None) -> list[str]:
    every = effects.model.effects if effects is not None else ()
    return [
        effect.name
        for effect in every
        if effect.terms and set(effect.terms) <= {"lateral_speed", "yaw_rate", "heading"}
    ]


def _with_right_instruments(ship: ShipOfSet) -> tuple[ShipOfSet, tuple[str, ...]]:
    """Return a ship whose instruments read right, and what was dropped for it."""
    names = _on_instruments(ship.effects)
    if ship.effects is None or not names:
        return ship, ()
    kept = np.concatenate([np.ones(6), [effect.name not in names for effect, _ in ship.effects.model.parameters]])
    covariance = np.where(np.outer(kept, kept) > 0.0, ship.covariance, 0.0)
    verb = "is" if len(names) == 1 else "are"
    remark = f"{', '.join(names)} {verb} in neither law nor simulated ship: her instruments read right"
    return replace(ship, effects=ship.effects.without(*names), covariance=covariance), (remark,)


def _not_simulated(ship: ShipOfSet, dropped: tuple[str, ...]) -> tuple[str, ...]:
    """Say what the simulator cannot do, or does to first order only."""
    if ship.effects is None:
        return ()
    on_instruments = _on_instruments(ship.effects) if dropped else []
    by_name = {effect.name: effect for effect in ship.effects.model.effects}

    def sails(entry: Carried) -> bool:
        effect = by_name[entry.effect]
        linear = entry.how == "carried" and not entry.sentence and not effect.states
        return effect.rudder_course is not None or entry.how == "shifts the course" or linear

    entries = carried(ship.hull, ship.effects, ship.speed_m_s, ship.arm_per_m)
    lacking = [entry.effect for entry in entries if entry.effect not in on_instruments and not sails(entry)]
    return (f"the simulated ship sails without {', '.join(lacking)}",) if lacking else ()


def _wrong(warehouse: Warehouse, wrong: str, ship: ShipOfSet) -> tuple[str, Hull, ShipEffects | None]:
    try:
        factor = float(wrong)
    except ValueError:
        other, _ = _with_right_instruments(ship_of_set(warehouse, named_set(warehouse, wrong), ship.speed_m_s))
        return f"{other.parameter_set.parameter_set_id} ({other.parameter_set.vessel})", other.hull, other.effects
    if not (isfinite(factor) and factor > 0.0):
        raise UsageError("wrong_factor", f"The factor is {wrong}, expected more than 0.", "Give 0.5 or 2, say.")
    hull = replace(ship.hull, b1=factor * ship.hull.b1, b2=factor * ship.hull.b2)
    return f"rudder taken for {factor:g} times as effective", hull, ship.effects


def _tried(label: str, hull: Hull, effects: ShipEffects | None, ship: ShipOfSet, request: SteerRequest) -> TriedLaw:
    law = course_law(
        hull,
        ship.speed_m_s,
        arm_per_m=ship.arm_per_m,
        spec=ship.spec,
        noise=ship.noise,
        settings=request.settings,
        effects=effects,
    )
    longest = 2.0 * request.leg_s + 2.0 * law.step_s
    steered = SteeredShip(
        _simulated_hull(ship, request.settings),
        request.environment,
        longest,
        seed=request.seed,
        gear=_simulated_gear(ship),
    )
    track = keep_course(steered, law, 2.0 * request.leg_s, 0.0, ((request.leg_s, request.change_rad),))
    change = course_change(track)
    assert change is not None
    return TriedLaw(
        label,
        hull,
        law,
        track,
        performance(track, request.settle_s, request.leg_s),
        change,
        closed_loop(law, ship.hull, ship.speed_m_s, ship.effects),
        share_held(law, ship.hull, ship.covariance, ship.speed_m_s, effects=ship.effects),
    )


#: parts of the simulated steering gear by what an effect makes of the rudder's course, made from its size
_PARTS: dict[str, Callable[[float], GearPart]] = {
    "rudder_lag": Lag,
    "dead_time": DeadTime,
    "backlash": Play,
    "rate_limit": RateLimit,
}


def _simulated_gear(ship: ShipOfSet) -> SteeringGear | None:
    """Return what lies between the rudder's reading and the hull of a parameter set, None where nothing does."""
    if ship.effects is None:
        return None
    sizes = [(effect.rudder_course, float(ship.effects.of(effect.name)[0])) for effect in ship.effects.model.effects]
    parts = [_PARTS[course](size) for course, size in sizes if course is not None and size > 0.0]
    zero = -linear_motion(ship.hull, ship.effects, ship.speed_m_s, arm_per_m=ship.arm_per_m).rudder_rad
    return SteeringGear(parts, zero) if parts or zero != 0.0 else None


def _simulated_hull(ship: ShipOfSet, settings: LawSettings) -> SimulatedHull:
    """Return the ship of a parameter set as the simulator takes her; without a length her speed stays constant."""
    hull = equivalent_hull(ship.hull, ship.effects, ship.speed_m_s)
    parameters = HullParameters(*(float(x) for x in hull.array()))
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
