"""``kempf steer``."""

from __future__ import annotations

from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from kempf.schemas.enumeration import as_words
from kempf.workbench.cli.given_once import GivenOnce
from kempf.workbench.cli.options import figure_option, json_option, verbose_option, vessel_option, warehouse_option
from kempf.workbench.new_file import require_figures, writing
from kempf.workbench.numbers import number
from kempf.workbench.terminal import print_json, print_table

if TYPE_CHECKING:
    from kempf.flows.jobs.steering.steer_vessel import Steered, TriedLaw


@click.command("steer", cls=GivenOnce)
@vessel_option(required=True)
@click.option("--set", "set_id", metavar="ID", help="Parameter set; default: the current one of the vessel.")
@click.option(
    "--wrong",
    metavar="FACTOR|ID",
    help="A second law from wrong parameters: the rudder taken for FACTOR times as effective, or another set.",
)
@click.option(
    "--method", type=click.Choice(["lqr", "poles"]), default="lqr", show_default=True, help="How the law is made."
)
@click.option("--speed", type=float, metavar="M/S", help="Speed through the water; default: that of the trial.")
@click.option("--minutes", type=float, default=20.0, show_default=True, help="Of each of the two legs of the track.")
@click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Of weather and noise.")
@figure_option("Draw the tracks")
@verbose_option
@warehouse_option
@json_option
def command(
    vessel: str,
    set_id: str | None,
    wrong: str | None,
    method: Any,
    speed: float | None,
    minutes: float,
    seed: int,
    figure: Path | None,
    verbose: bool,
    uri: str,
    as_json: bool,
) -> None:
    """Make a course-keeping law from a parameter set and try it on the simulated ship in wind and stream.

    The ship that is steered has the parameters of the set: the track shows what the law does to her, and what wrong
    parameters cost. It does not show that the parameters are right. Law and ship have the effects of the set, as far as
    a linear law and the simulator can; the warnings name the rest.
    """
    from kempf.flows.jobs.steering.steer_vessel import SteerRequest, steer_vessel
    from kempf.pipeline.steering.course_keeping import LawSettings
    from kempf.warehouse.storage.store import Warehouse

    require_figures(figure, code="cannot_write")
    request = SteerRequest(set_id, wrong, speed, LawSettings(method=method), leg_s=60.0 * minutes, seed=seed)
    outcome = steer_vessel(Warehouse(uri), vessel, request)
    if figure is not None:
        _draw(outcome, figure)
    if as_json:
        print_json(_show(outcome, figure))
    else:
        _print_steered(outcome, figure, verbose=verbose)


def _draw(outcome: Steered, figure: Path) -> None:
    from kempf.workbench.figures.course_keeping import draw_course_keeping

    labels = ["from the set", "from wrong parameters"]
    tracks = [(label, tried.track) for label, tried in zip(labels, outcome.laws, strict=False)]
    with writing(figure):
        draw_course_keeping(
            tracks, figure, f"{outcome.ship.parameter_set.vessel} at {number(outcome.ship.speed_m_s)} m/s"
        )


def _show(outcome: Steered, figure: Path | None) -> dict[str, Any]:
    wind = outcome.request.environment
    return {
        "vessel": outcome.ship.parameter_set.vessel,
        "parameter_set_id": outcome.ship.parameter_set.parameter_set_id,
        "speed_m_s": outcome.ship.speed_m_s,
        "track": {
            "leg_s": outcome.request.leg_s,
            "settle_s": outcome.request.settle_s,
            "course_change_deg": degrees(outcome.request.change_rad),
            "seed": outcome.request.seed,
            "wind_force_m_s2": {"mean": wind.wind_force.mean, "std": wind.wind_force.std},
            "current_m_s": {"north": wind.current_north.mean, "east": wind.current_east.mean},
        },
        "laws": [_law(tried) for tried in outcome.laws],
        "effects": {p.name: {"value": p.value, "std": p.std, "unit": p.unit} for p in outcome.ship.effect_parameters},
        "figure": str(figure) if figure else None,
        "warnings": list(outcome.warnings),
    }


def _law(tried: TriedLaw) -> dict[str, Any]:
    p, law, loop = tried.performance, tried.law, tried.loop
    return {
        "parameters": tried.label,
        "law": {
            "method": law.settings.method,
            "step_s": law.step_s,
            "states": list(law.plant.states),
            "gain": dict(zip(law.plant.states, (float(g) for g in law.feedback), strict=True)),
            "rudder_rad_per_wind_force": law.rudder_per_force,
            "estimator_gain": law.observer.tolist(),
        },
        "performance": {
            "heading_rms_deg": degrees(p.heading_rms_rad),
            "heading_mean_deg": degrees(p.heading_mean_rad),
            "heading_max_deg": degrees(p.heading_max_rad),
            "rudder_rms_deg": degrees(p.rudder_rms_rad),
            "rudder_mean_deg": degrees(p.rudder_mean_rad),
            "rudder_travel_deg_per_min": 60.0 * degrees(p.rudder_travel_rad_s),
            "drift_m_s": p.drift_m_s,
            "cross_track_rms_m": p.cross_track_rms_m,
            "kept": p.kept,
        },
        "course_change": {
            "overshoot_deg": degrees(tried.change.overshoot_rad),
            "settled_s": tried.change.settled_s,
        },
        "closed_loop": {
            "stable": loop.stable,
            "poles": [[float(z.real), float(z.imag)] for z in loop.poles],
            "slowest_s": loop.slowest_s,
            "least_damping": loop.least_damping,
            "modulus_margin": loop.modulus_margin,
            "share_of_allowed_ships_held": tried.held,
        },
    }


def _print_steered(outcome: Steered, figure: Path | None, *, verbose: bool) -> None:
    from kempf.workbench.ranked_warnings import show_warnings

    shown = [_law(tried) for tried in outcome.laws]
    rows = [
        (
            f"{as_words(key.removesuffix('_deg'))}, deg" if key.endswith("_deg") else _WORDS.get(key, key),
            group,
            key,
        )
        for group, keys in _ROWS.items()
        for key in keys
    ]
    cells = [[name, *(_cell(tried[group][key], key) for tried in shown)] for name, group, key in rows]
    head = ["", "from the set", "from wrong parameters"][: len(shown) + 1]
    about = f"{outcome.ship.parameter_set.vessel}, {outcome.ship.parameter_set.parameter_set_id}"
    print_table(head, cells, f"{about} at {number(outcome.ship.speed_m_s)} m/s, {shown[0]['law']['method']}")
    if len(shown) > 1:
        click.echo(f"  wrong: {shown[1]['parameters']}")
    gains = ", ".join(f"{name} {number(-gain)}" for name, gain in shown[0]["law"]["gain"].items() if gain)
    click.echo(f"  rudder order in rad from the set: {gains} (SI), every {number(shown[0]['law']['step_s'])} s")
    for p in outcome.ship.effect_parameters:
        click.echo(f"  effect: {p.name} {number(p.value)} ± {number(p.std, 2)} {p.unit} (1 s.e.)")
    if figure is not None:
        click.echo(f"  drawn: {figure}")
    show_warnings(outcome.warnings, verbose=verbose)


_ROWS = {
    "performance": (
        "heading_rms_deg",
        "heading_mean_deg",
        "rudder_rms_deg",
        "rudder_mean_deg",
        "rudder_travel_deg_per_min",
        "drift_m_s",
        "cross_track_rms_m",
    ),
    "course_change": ("overshoot_deg", "settled_s"),
    "closed_loop": ("stable", "slowest_s", "modulus_margin", "share_of_allowed_ships_held"),
}
_WORDS = {
    "rudder_travel_deg_per_min": "rudder travel, deg/min",
    "drift_m_s": "drift across the course, m/s",
    "cross_track_rms_m": "rms beside the drift line, m",
    "settled_s": "settled on the new course after, s",
    "stable": "loop stable",
    "slowest_s": "slowest pole, s",
    "modulus_margin": "modulus margin",
    "share_of_allowed_ships_held": "ships within the errors of the set kept stable, %",
}


def _cell(value: float | bool | None, key: str) -> str:
    if isinstance(value, bool):
        return "yes" if value else "NO"
    return number(100.0 * value if value is not None and key.startswith("share") else value, 3)
