"""Another loading condition from log to log: a heavier ship answers all forces by less.

The number of the log among the vessel's is the measure, so with three logs the change of the first step is taken to
repeat itself; a12 is left alone, most of it is the ship's own inertia.
"""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="load_condition",
    title="change of the loading condition",
    group="other",
    plain=(
        "From one log to the next the ship is more, or less, deeply laden, and answers hull and rudder by less, "
        "or more."
    ),
    equation="a11, a21, a22, b1, b2 become (1 + c day) times themselves",
    reference=(
        "ITTC recommended procedure 7.5-02-06-01, Free running model tests; Clarke, Gedling & Hine 1983, Trans. "
        "RINA 125"
    ),
    parameters=(
        Parameter("c", "1", -0.3, 0.5, (0.05,), "share by which hull and rudder act more from one log to the next"),
    ),
    terms={"sway": "c*day*(a11*V*v + b1*V**2*delta)", "yaw": "c*day*(a21*V*v + a22*V*r + b2*V**2*delta)"},
    confounded_with="shallow_water, fouling, and whatever else differs between two days; nothing within one log",
    separated_by="Draughts read before each trial; `kempf history` shows when and in what the ship changed.",
)
