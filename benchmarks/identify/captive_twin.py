"""Ships whose physics is known and is none of ours: zigzags of the MMG standard method, and the circles beyond them.

Zigzags of the tank's thirteen orders as a model from captive tests sails them, 170 s each, written as the tank's logs
are, through the whole job. Then her turning circles with 35 deg of rudder as the program predicts them beside those
that she makes: what is tighter than anything in the logs. The first ship is the KVLCC2 as published, the others have
coefficients scattered. An interval is that of all models that the diagnosis does not tell apart.
"""

from __future__ import annotations

import argparse
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

import numpy as np

from benchmarks import result_page
from benchmarks.baselines.mmg_standard import Peer
from benchmarks.identify import peers
from kempf.flows.jobs.diagnose.diagnose_vessel import diagnose_vessel
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.standing_model import NONE_OF_ONES_OWN, point
from kempf.flows.jobs.identify.vessel_model import store_model
from kempf.flows.jobs.ingest.files import read_model, read_profiles
from kempf.flows.jobs.ingest.ingest_logs import ingest
from kempf.flows.jobs.predict.checked_prediction import predict_checked
from kempf.flows.jobs.predict.predict_request import PredictRequest
from kempf.schemas.errors import KempfError
from kempf.schemas.model_spec import ModelSpec
from kempf.warehouse.storage.store import Warehouse

_DOCS = Path(__file__).parents[2] / "docs"
_VESSEL = "hsva_kvlcc2"
#: which side first, rudder and heading, deg, as in the tank; how long each goes on, s
_RUNS = (
    *((1, rudder, heading) for rudder, heading in ((5, 1), (10, 1), (15, 1), (10, 5), (15, 5), (20, 5), (25, 5))),
    *((1, rudder, heading) for rudder, heading in ((30, 5), (35, 5), (10, 10), (20, 10))),
    *((-1, rudder, heading) for rudder, heading in ((10, 10), (20, 10))),
)
_UNTIL_S = 170.0
#: standard deviations of heading, deg, velocity, m/s, yaw rate, deg/s, and rudder, deg
_HEADING, _VELOCITY, _RATE, _RUDDER = 0.02, 0.003, 0.03, 0.02
#: standard deviation of the logarithm of a scattered coefficient
_SCATTER = 0.15
_FIGURES = {
    **{"advance_m": "advance, m", "transfer_m": "transfer, m", "tactical_diameter_m": "tactical diameter, m"},
    **{"steady_yaw_rate_deg_s": "steady yaw rate, deg/s", "speed_loss_percent": "speed loss, %"},
}


def ship(number: int) -> Peer:
    """Return a ship: 0 is the published one, the others have coefficients of sway, yaw and rudder inflow scattered."""
    data: Mapping[str, Any] = peers.data()
    if number == 0:
        return Peer.of(data)
    rng = np.random.default_rng(number)

    def scattered(coefficients: Mapping[str, float], names: tuple[str, ...]) -> dict[str, float]:
        factors = {name: float(np.exp(_SCATTER * rng.standard_normal())) for name in names}
        return {name: value * factors.get(name, 1.0) for name, value in coefficients.items()}

    mmg = dict(data["mmg"])
    mmg |= {part: scattered(mmg[part], tuple(mmg[part])) for part in ("sway", "yaw")}
    mmg["rudder"] = scattered(mmg["rudder"], ("gamma_starboard", "gamma_port"))
    return Peer.of({**data, "mmg": mmg})


def sail(peer: Peer, folder: Path, rng: np.random.Generator) -> list[Path]:
    """Write the zigzags of a ship as the tank's logs are, and return their paths."""
    paths = []
    for side, rudder_deg, heading_deg in _RUNS:
        rows = peer.zigzag(np.deg2rad(heading_deg), np.deg2rad(rudder_deg), side, _UNTIL_S)
        t, u, v, r, psi, x, y, rudder = rows.T
        north, east = u * np.cos(psi) - v * np.sin(psi), u * np.sin(psi) + v * np.cos(psi)
        noise = rng.standard_normal((5, t.size))
        shaft = np.full(t.size, peer.revolutions_per_s)
        columns = [
            *(t, x, y, np.rad2deg(psi) + _HEADING * noise[0]),
            *(north + _VELOCITY * noise[1], east + _VELOCITY * noise[2], np.rad2deg(r) + _RATE * noise[3]),
            *(np.zeros(t.size), -np.rad2deg(rudder) + _RUDDER * noise[4], shaft, np.zeros(t.size), np.zeros(t.size)),
        ]
        path = folder / f"HSVA_CPMC_KVLCC2_Z_{rudder_deg:02d}_{heading_deg:02d}_{'P' if side < 0 else 'S'}.dat"
        np.savetxt(path, np.column_stack(columns), fmt="%.9f", header="MMG standard method\n\n\n", comments=" ")
        paths.append(path)
    return sorted(paths)


def _figures(warehouse: Warehouse, peer: Peer, words: str, set_id: str) -> list[list[str]]:
    rows = []
    for side, sign in (("starboard", 1), ("port", -1)):
        own = peer.circle(sign * np.deg2rad(35.0))
        rate = float(np.rad2deg(peer.rudder_rate_rad_s))
        request = PredictRequest("turning-circle", set_id, side=side, rudder_rate_deg_s=rate)
        try:
            figures = predict_checked(warehouse, _VESSEL, request).prediction.figures
        except KempfError as error:
            rows.append([words, side, f"refused: {error.message}", *[""] * (len(_FIGURES) - 1)])
            continue
        cells = []
        for name in _FIGURES:
            true, figure = float(getattr(own, name)), figures[name]
            if figure.value is None or figure.low is None or figure.high is None:
                cells.append(f"{true:.3g}: not predicted")
                continue
            mark = "" if figure.low <= true <= figure.high else ", outside"
            off = 100.0 * (figure.value / true - 1.0)
            cells.append(f"{true:.3g}: {figure.value:.3g} ({figure.low:.3g} to {figure.high:.3g}{mark}), {off:+.0f} %")
        rows.append([words, side, *cells])
    return rows


def _of(number: int, model: ModelSpec) -> list[str]:
    """Return the part of the page of a ship: what is concluded, and circles by it and by either law of cross-flow."""
    peer = ship(number)
    with TemporaryDirectory() as place, TemporaryDirectory() as logs:
        warehouse = Warehouse(place)
        paths = sail(peer, Path(logs), np.random.default_rng([number, 1]))
        ingest(warehouse, paths, _VESSEL, read_profiles([_DOCS / "profiles" / "hsva_kvlcc2.yaml"]))
        shown = diagnose_vessel(warehouse, _VESSEL, model)[0].as_json()
        added = tuple(step["added"] for step in shown["ladder"] if step["added"])
        alone = [(name,) for name in ("cross_flow_drag", "cross_flow_cubic") if (name,) != added]
        rows = []
        for effects in (added, *alone):
            spec = model.model_copy(update={"effects": effects})
            fitted, _ = store_model(warehouse, choose(warehouse, _VESSEL), spec, NONE_OF_ONES_OWN)
            point(warehouse, fitted)
            rows += _figures(warehouse, peer, " + ".join(effects) or "plain", fitted.parameter_set_id)
    misfit = [step["one_leg_ahead"]["held_out_misfit"] for step in (shown["ladder"][0], shown["ladder"][-1])]
    sets = "; ".join(" or ".join(chosen["effects"]) for chosen in shown["sets"]) or "none"
    return [
        f"## Ship {number}: {shown['verdict'].replace('_', ' ')}",
        "",
        f"Sets of effects: {sets}. The misfit one leg ahead in manoeuvres held out comes to "
        f"{misfit[1] / misfit[0]:.2f} of the plain model's.",
        "",
        *result_page.table(["model", "35 deg to", *_FIGURES.values()], rows),
        "",
    ]


def main() -> None:
    """Sail and judge the ships, and write ``results/captive_twin.md``."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--ships", type=int, default=2)
    given = parser.parse_args()
    model = read_model(_DOCS / "models" / "tank.yaml")
    lines = [
        "Cells: her own, then predicted from her zigzags with its 95 % interval, which is that of all models that the "
        "diagnosis does not tell apart. The first model of each ship is the one that `kempf diagnose` ends with; the "
        "others are fitted beside it.",
        "",
    ]
    for number in range(given.ships):
        lines += _of(number, model)
    title, options = "Circles of ships of the MMG standard method, from zigzags", f"--ships {given.ships}"
    result_page.write("identify.captive_twin", title, lines, options=options)


if __name__ == "__main__":
    main()
