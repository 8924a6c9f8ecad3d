"""The entry: settings in, a simulated trial out, with its truth and what every instrument made of it.

`to_nmea`, `to_csv` and `to_mcap` turn it into the bytes of a logger; equal settings give equal bytes.
"""

from __future__ import annotations

from dataclasses import dataclass

from kempf.pipeline.simulate.disturbances import CALM, Disturbance, Environment
from kempf.pipeline.simulate.hulls import HULLS, HullParameters, SimulatedHull
from kempf.pipeline.simulate.instruments import DEFAULT_INSTRUMENTS, Instrument, InstrumentRecord, measure
from kempf.pipeline.simulate.manoeuvre import ManoeuvreRecord, SteadyCourse, Step, ZigzagTest
from kempf.pipeline.simulate.programme import GRID_S, sail
from kempf.pipeline.simulate.random_streams import stream
from kempf.pipeline.simulate.sensors import Setting
from kempf.pipeline.simulate.trajectory import Trajectory
from kempf.schemas.errors import UsageError
from kempf.schemas.side import Side

#: The disturbances of the paper's simulated trial: force 5e-3 m/s^2, here with a slow part, and a stream of 0.3 m/s.
PAPER_ENVIRONMENT = Environment(
    wind_force=Disturbance(5e-3, 1e-3, 1.0 / 300.0),
    current_north=Disturbance(0.15),
    current_east=Disturbance(0.2598),
)


@dataclass(frozen=True)
class TrialSettings:
    """Everything that decides a simulated trial.

    Parameters
    ----------
    hull : SimulatedHull
        The ship, such as one of `kempf.pipeline.simulate.hulls.HULLS`.
    programme : tuple of Step
        What she does; see `kempf.pipeline.simulate.manoeuvre`.
    environment : Environment
        What acts on her.
    instruments : tuple of Instrument
        What she carries, each name once.
    seed : int
        Of everything random.
    noise_scale : float
        Factor on every standard deviation of measurement noise.
    start_utc_ns : int
        UTC of the beginning.
    heading_deg : float
        Heading at the beginning.
    latitude_deg, longitude_deg : float
        Where she begins.
    antenna_forward_m, antenna_starboard_m : float
        GNSS antenna, from midships on the centre line.
    substeps : int
        Integrator steps in a cell of 0.02 s.
    """

    hull: SimulatedHull
    programme: tuple[Step, ...]
    environment: Environment = CALM
    instruments: tuple[Instrument, ...] = DEFAULT_INSTRUMENTS
    seed: int = 0
    noise_scale: float = 1.0
    start_utc_ns: int = 1_746_252_000_000_000_000  # 2025-05-03T06:00:00Z
    heading_deg: float = 0.0
    latitude_deg: float = 59.9
    longitude_deg: float = 24.6
    antenna_forward_m: float = 0.0
    antenna_starboard_m: float = 0.0
    substeps: int = 1


@dataclass(frozen=True, eq=False)
class Truth:
    """What an estimator should find."""

    #: Of eq. (16).
    parameters: HullParameters
    #: l of eq. (16).
    wind_arm_per_m: float
    #: The path on the fine grid.
    trajectory: Trajectory
    #: One a step of the programme.
    manoeuvres: tuple[ManoeuvreRecord, ...]

    @property
    def zigzags(self) -> tuple[ManoeuvreRecord, ...]:
        """The records of the zigzags alone."""
        return tuple(m for m in self.manoeuvres if isinstance(m.step, ZigzagTest))


@dataclass(frozen=True, eq=False)
class Trial:
    """A simulated trial."""

    #: What it was made from.
    settings: TrialSettings
    #: What really happened.
    truth: Truth
    #: What was measured, in the order of the settings.
    instruments: tuple[InstrumentRecord, ...]

    def record(self, name: str) -> InstrumentRecord:
        """Return the record of one instrument by its name.

        Raises
        ------
        UsageError
            The trial has no such instrument.
        """
        for record in self.instruments:
            if record.instrument.name == name:
                return record
        raise UsageError(
            "instrument_absent",
            f"The trial carries no instrument {name!r}.",
            f"Ask for one of {', '.join(r.instrument.name for r in self.instruments)}, or add it to the settings.",
        )


def simulate_trial(settings: TrialSettings) -> Trial:
    """Sail the programme and let the instruments measure it.

    Parameters
    ----------
    settings : TrialSettings
        See there.

    Raises
    ------
    UsageError
        The programme or an instrument is impossible, or two instruments have one name.

    Examples
    --------
    >>> trial = simulate_trial(zigzag_settings("ferry", duration_s=300.0, steady_s=60.0))
    >>> len(trial.truth.zigzags[0].executes_s) >= 4
    True
    """
    names = [i.name for i in settings.instruments]
    if len(set(names)) != len(names):
        raise UsageError(
            "instrument_twice", f"An instrument is named twice among {', '.join(names)}.", "Give every instrument once."
        )
    if settings.seed < 0 or settings.substeps < 1 or settings.noise_scale < 0:
        raise UsageError(
            "trial_settings",
            f"seed {settings.seed}, substeps {settings.substeps}, noise_scale {settings.noise_scale}: expected "
            "at least 0, 1 and 0.",
            "Correct the settings.",
        )
    trajectory, manoeuvres = sail(
        settings.hull,
        settings.programme,
        settings.environment,
        seed=settings.seed,
        heading_deg=settings.heading_deg,
        substeps=settings.substeps,
    )
    rows = trajectory.state.shape[0]
    setting = Setting(
        settings.latitude_deg,
        settings.longitude_deg,
        settings.antenna_forward_m,
        settings.antenna_starboard_m,
        settings.environment.wind_speed.path(rows, GRID_S, stream(settings.seed, "wind_speed")),
        GRID_S,
        settings.environment.wind_from_rad,
        settings.environment.water_depth_m,
    )
    records = tuple(
        measure(
            i,
            trajectory,
            settings.hull,
            setting,
            start_utc_ns=settings.start_utc_ns,
            seed=settings.seed,
            noise_scale=settings.noise_scale,
        )
        for i in settings.instruments
    )
    truth = Truth(settings.hull.parameters, settings.hull.wind_arm_per_m, trajectory, manoeuvres)
    return Trial(settings, truth, records)


def zigzag_settings(
    hull: str = "mariner",
    *,
    heading_deg: float = 20.0,
    rudder_deg: float = 20.0,
    first_side: Side = "starboard",
    duration_s: float = 1200.0,
    steady_s: float = 120.0,
    environment: Environment = PAPER_ENVIRONMENT,
    noise_scale: float = 1.0,
    seed: int = 0,
) -> TrialSettings:
    """Return the settings of the standard trial: a steady course, then a zigzag for ``duration_s``.

    With the defaults: 20 minutes of 20/20 zigzag, 1 Hz GNSS and yaw rate with 0.05 m/s and 0.03 deg/s noise, wind force
    5e-3 m/s^2 with a slow part of 1e-3, stream 0.3 m/s.

    Parameters
    ----------
    hull : str
        A key of `kempf.pipeline.simulate.hulls.HULLS`.
    heading_deg, rudder_deg : float
        psi0 and delta0.
    first_side : {"starboard", "port"}
        Of the first execute.
    duration_s, steady_s : float
        Of the zigzag and of the steady course before it.
    environment : Environment
        What acts on her.
    noise_scale : float
        Factor on the measurement noise.
    seed : int
        Of everything random.

    Raises
    ------
    UsageError
        There is no such hull.
    """
    if hull not in HULLS:
        raise UsageError("hull_unknown", f"There is no hull {hull!r}.", f"Take one of {', '.join(HULLS)}.")
    programme = (SteadyCourse(steady_s), ZigzagTest(heading_deg, rudder_deg, first_side, duration_s=duration_s))
    return TrialSettings(HULLS[hull], programme, environment, seed=seed, noise_scale=noise_scale)
