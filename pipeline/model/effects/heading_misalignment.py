"""The heading sensor is turned against the ship's axis."""

from __future__ import annotations

from kempf.pipeline.model.terms.effect import Effect, Parameter

EFFECT = Effect(
    name="heading_misalignment",
    title="misalignment of the heading",
    group="sensor",
    plain="The compass is mounted askew, so that going straight ahead looks like drifting.",
    equation="y_v += -c V",
    reference="ITTC recommended procedure 7.5-02-06-01, Free running model tests; eq. (18)",
    parameters=(Parameter("c", "rad", -0.3, 0.3, (0.01,), "angle by which the heading reads too far clockwise"),),
    terms={"lateral_speed": "-c*V"},
    confounded_with="the paper's lateral current V_T; earth_current on one heading",
    separated_by=(
        "Runs on opposite headings: the current's lateral part changes its sign, the misalignment does not; a run "
        "at another speed does the same."
    ),
)
