"""What the noise of an input does to a coefficient: ``python -m benchmarks.identify.noisy_inputs``.

Ships with a force that goes by the wind, their roll or the depth, and with noisy instruments; the true structure is
fitted to their logs twice, with these channels as they were read and as their readings let expect them
(docs/decisions/0074 and 0080). The ships share no code with the estimator. Readings, lateness and speed through the
water do not differ.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from unittest.mock import patch

from benchmarks import result_page
from benchmarks.diagnose.hidden_effects.cases import Case
from benchmarks.diagnose.hidden_effects.taken_in import taken_in
from benchmarks.diagnose.hidden_effects.write import logs_of
from kempf.flows.jobs.identify.chosen_manoeuvres import choose
from kempf.flows.jobs.identify.vessel_runs import assembled
from kempf.pipeline.channels.series import Float, Series
from kempf.pipeline.channels.signal import Signal
from kempf.pipeline.diagnose.screening.staged import staged
from kempf.pipeline.estimate import agreement
from kempf.pipeline.estimate.pooled_fit import PooledFit
from kempf.schemas.effects import get
from kempf.schemas.model_spec import ModelSpec

#: effect, hull and a seed for each ship: two of every kind, their noise twice what is usual
_SHIPS = tuple(
    (effect, hull, seed)
    for effect in ("wind_force", "roll_coupling", "shallow_water")
    for hull in ("mariner", "ferry", "usv")
    for seed in (11, 12)
)


#: where the noise of these channels is taken out
_NOISE_OUT = tuple(f"kempf.pipeline.estimate.record.{room}.signal" for room in ("conditions", "heel"))


def as_read(series: Series, shapes: Sequence[Float] = ()) -> Signal:
    """Return the readings themselves, where `kempf.pipeline.channels.signal.signal` would take their noise out."""
    return Signal(series, 0.0, 0.0)


def fits(case: Case) -> tuple[float, tuple[PooledFit, PooledFit]]:
    """Return the true size, and the true structure fitted with the inputs as read and as expected."""
    with TemporaryDirectory() as folder:
        files, answer = logs_of(case)
        warehouse, made = taken_in(files, Path(folder)), []
        for noisy in (True, False):
            with ExitStack() as patches:
                for place in _NOISE_OUT if noisy else ():
                    patches.enter_context(patch(place, as_read))
                found = assembled(warehouse, choose(warehouse, case.case_id), ModelSpec())
            with ThreadPoolExecutor(2) as workers:
                made.append(staged(found.runs, found.spec, [get(case.effect)], workers)[1][-1])
        return float(next(iter(answer["parameters"].values()))), (made[0], made[1])


def _row(case: Case) -> tuple[list[str], list[bool]]:
    """Return the line of a ship, and whether each interval holds the true size."""
    true, both = fits(case)
    shown, held = [], []
    for fit in both:
        at = fit.model.names.index(f"{case.effect}.{get(case.effect).parameters[0].name}")
        value, std = float(fit.values[at]), agreement.agreement_of(fit).widened * float(fit.std[6 + at])
        shown.append(f"{value / true:.3f} ± {std / abs(true):.3f}")
        held.append(abs(value - true) <= 1.96 * std)
    gained = both[1].log_likelihood - both[0].log_likelihood
    return [case.effect, case.hull, str(case.seed), f"{true:.3g}", *shown, f"{gained:.0f}"], held


def main() -> None:
    """Fit the ships and write the page."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--noise", type=float, default=2.0, help="factor on the usual noise")
    parser.add_argument("--at-most", type=int, default=len(_SHIPS))
    given = parser.parse_args()
    rows, held = [], []
    for number, (effect, hull, seed) in enumerate(_SHIPS[: given.at_most]):
        name = f"{effect}-{hull}-{seed}".replace("_", "-")
        formats = (("mcap", "nmea"), ("nmea", "csv"))[number % 2]
        case = Case(
            *(name, "catalogue", effect, hull, given.noise, "moderate"),
            strength=1,
            sold=False,
            formats=formats,
            seed=seed,
        )
        row, inside = _row(case)
        print(*row, sep=" | ", flush=True)
        rows.append(row)
        held.append(inside)
    read, expected = (sum(one[k] for one in held) for k in range(2))
    lines = [
        f"Two days of zigzags in a moderate sea, noise {given.noise:g} times the usual. Sizes over the true one, ± one "
        "standard error, and the log-likelihood that the model gains with its inputs as expected.",
        "",
        *result_page.table(
            ("effect", "ship", "seed", "true", "inputs as read", "inputs as expected", "gained"),
            rows,
        ),
        "",
        f"In the 95 % interval: {read} of {len(held)} with inputs as read, {expected} of {len(held)} as expected.",
    ]
    options = f"--noise {given.noise:g}" if given.noise != 2.0 else ""
    result_page.write(
        "identify.noisy_inputs", "What the noise of an input does to a coefficient", lines, options=options
    )


if __name__ == "__main__":
    main()
