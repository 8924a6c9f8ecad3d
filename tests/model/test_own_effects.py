"""Effects of a person's own, by formula and by file: what works, and what is refused with which words."""

from __future__ import annotations

import pytest

from kempf.pipeline.model.terms.ordinary import require_ordinary
from kempf.pipeline.model.terms.own import from_expression, from_file
from kempf.schemas.effect import ExtraState, Parameter
from kempf.schemas.effects import catalogue, require_free
from kempf.schemas.errors import UsageError

ALL = catalogue()


def test_effects_that_cannot_be_computed_are_refused() -> None:
    good, noisy = ALL["yaw_quadratic"], ExtraState(name="m1", derivative="v", noise="c*r")
    for change, code in (
        ({"terms": {"yaw": "c*v/r"}}, "effect_not_finite"),
        ({"terms": {"yaw": "c*sqrt(abs(v))"}}, "effect_not_finite"),
        ({"terms": {"yaw": "r*abs(r)"}}, "effect_not_absent"),
        ({"terms": {"yaw": "c*m1"}}, "symbol_out_of_place"),
        ({"terms": {"yaw": "c*rdot"}}, "symbol_out_of_place"),
        ({"terms": {"speed": "c*delta"}}, "symbol_out_of_place"),
        ({"terms": {"yaw": "c*m1"}, "states": (noisy,)}, "symbol_out_of_place"),
        ({"terms": {"yaw": "m1"}, "states": (ExtraState(name="m1", derivative="v - m1"),)}, "effect_not_absent"),
        ({"parameters": (Parameter(name="k", low=-1.0, high=1.0, steps=(0.1,)),)}, "expression_invalid"),
    ):
        with pytest.raises(UsageError) as caught:
            require_ordinary(good.model_copy(update=change))
        assert caught.value.code == code
    with pytest.raises(UsageError, match="at v = 0, r = 0"):
        require_ordinary(good.model_copy(update={"terms": {"yaw": "c*v/r"}}))


def test_own_expressions() -> None:
    plain = from_expression(["yaw: r*abs(r)"], "mine")
    assert (plain.name, dict(plain.terms), [p.name for p in plain.parameters]) == (
        "mine",
        {"yaw": "c*(r*abs(r))"},
        ["c"],
    )
    two = from_expression(["sway: c*v; yaw: k*r"])
    assert (dict(two.terms), [p.name for p in two.parameters]) == ({"sway": "c*v", "yaw": "k*r"}, ["c", "k"])
    assert dict(from_expression(["yaw: c*r", "yaw: k*v"]).terms) == {"yaw": "(c*r) + (k*v)"}
    assert from_expression(["yaw: U**2*sin(2*gamma)"]).needs == ("wind_speed", "wind_angle")
    assert from_expression(["lateral_speed: tau*vdot"]).parameters[0].name == "tau"
    for effect in (plain, two):
        require_ordinary(effect)
        for p in effect.parameters:
            assert p.low < 0.0 < p.steps[0] < p.high and not p.shapes
        assert "yaw acceleration" in effect.plain


@pytest.mark.parametrize(
    ("text", "makers", "shapes"),
    [
        ("yaw: c*tanh(k*v)", ["c"], ["k"]),
        ("yaw: c*v*exp(k*r)", ["c"], ["k"]),
        ("yaw: exp(k*v) - 1", ["k"], []),
        ("sway: c*v + k*tanh(tau*r)", ["c", "k"], ["tau"]),
        ("yaw: k*sin(tau*t)", ["k"], ["tau"]),
        ("sway: c1*v**3 + c2*v*r**2; yaw: c3*r", ["c1", "c2", "c3"], []),
    ],
)
def test_numbers_that_make_are_told_from_numbers_that_shape(text: str, makers: list[str], shapes: list[str]) -> None:
    effect = from_expression([text])
    assert [p.name for p in effect.parameters] == [*makers, *shapes]
    assert [p.name for p in effect.parameters if p.shapes] == shapes
    for p in effect.parameters:
        assert len(p.steps) == (3 if p.shapes else 1)
        assert all(p.low < step < p.high for step in p.steps)
    require_ordinary(effect)


@pytest.mark.parametrize(
    ("text", "code", "message"),
    [
        ("yaw: c1*r + c2*v + c3*V + c4*delta + c5*r**3 + c6*v**3 + c7*r*r", "effect_numbers", "7 unknown numbers"),
        ("yaw: c*k*r", "effect_no_effect", "but what another number"),
        ("yaw: rr", "expression_invalid", "did you mean 'r'"),
        ("yaw: c*vv", "expression_invalid", "'vv' is not known"),
        ("yaw: sine(v)", "expression_invalid", "did you mean 'sin'"),
        ("yaw: c10*v", "expression_invalid", "'c10' is not known"),
        ("yw: r", "effect_target", "did you mean 'yaw'"),
        ("r*abs(r)", "expression_invalid", "does not say what the formula acts on"),
        ("", "expression_invalid", "nothing is written"),
        (" ; ", "expression_invalid", "nothing is written"),
        ("yaw:", "expression_invalid", "it is empty"),
        ("yaw: r); (v", "expression_invalid", "no formula"),
        ("yaw: v/r", "effect_not_finite", "at v = 0, r = 0"),
        ("yaw: 1/0", "effect_not_finite", "no finite value"),
        ("yaw: log(v)", "effect_not_finite", "ordinary state"),
        ("yaw: ((9.0**9)**9)**9 * v", "effect_not_finite", "no finite value"),
        ("yaw: exp(k*v)", "effect_not_absent", "still 1"),
        ("yaw: r - r", "effect_no_effect", "changes nothing"),
        ("yaw: c*v + k*0", "effect_no_effect", "'k' changes nothing"),
        ("yaw: vdot", "symbol_out_of_place", "'vdot'"),
        ("speed: delta", "symbol_out_of_place", "'delta'"),
        ("yaw: m1", "symbol_out_of_place", "no state of this effect"),
        (";".join(["yaw: r"] * 9), "expression_invalid", "9 formulas"),
    ],
)
def test_own_expressions_that_are_refused(text: str, code: str, message: str) -> None:
    with pytest.raises(UsageError) as caught:
        from_expression([text])
    assert (caught.value.code, message in caught.value.message) == (code, True), caught.value.message
    assert caught.value.next_step


@pytest.mark.parametrize("name", ["", "Own", "a b", "../x", "a" * 41, "1a", "é"])
def test_a_name_that_is_none_is_refused(name: str) -> None:
    with pytest.raises(UsageError, match="cannot be called"):
        from_expression(["yaw: r"], name)


FILE = """
name: mine
plain: My own drag.
reference: my own measurements
terms: {yaw: "-c*r*abs(r)"}
parameters:
  c: {unit: "1", low: -1, high: 5, steps: [0.5]}
"""


def test_an_effect_file() -> None:
    effect = from_file(FILE, "mine.yaml")
    assert (effect.name, effect.group, effect.title) == ("mine", "own", "mine")
    assert effect.parameters == (Parameter(name="c", unit="1", low=-1.0, high=5.0, steps=(0.5,)),)
    assert effect.sha256 == from_file(FILE, "elsewhere.yaml").sha256
    with_state = FILE.replace('"-c*r*abs(r)"}', '"c*(r - m1)"}\nstates: {m1: {derivative: "(r - m1)*V/L"}}')
    assert from_file(with_state, "x").states == (ExtraState(name="m1", derivative="(r - m1)*V/L"),)


def test_an_effect_file_says_all_that_the_catalogues_say() -> None:
    text = FILE.replace("terms:", "rudder_course: rudder_lag\nmeasured_by: [roll]\ngroup: hull\ntitle: drag\nterms:")
    effect = from_file(text, "mine.yaml")
    assert (effect.rudder_course, effect.measured_by) == ("rudder_lag", ("roll",))
    assert (effect.group, effect.title) == ("hull", "drag")
    alone = from_file(FILE.replace('terms: {yaw: "-c*r*abs(r)"}', "rudder_course: dead_time"), "mine.yaml")
    assert alone.terms == {} and alone.rudder_course == "dead_time"
    with pytest.raises(UsageError, match="it has no term"):
        from_file(FILE.replace('terms: {yaw: "-c*r*abs(r)"}', ""), "mine.yaml")


def test_a_user_s_own_effect_bears_no_name_of_the_catalogue() -> None:
    require_free("my_yaw_cubic")
    with pytest.raises(UsageError, match="'yaw_cubic' is an effect of the catalogue") as caught:
        require_free("yaw_cubic")
    assert caught.value.code == "effect_name" and "my_yaw_cubic" in caught.value.next_step


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("name: mine", "name: My effect"), "cannot be called"),
        (("plain: My own drag.", ""), "plain: the key is missing"),
        (("terms:", "term:"), "term: there is no such key"),
        (("r*abs(r)", "rr"), "terms.yaw"),
        (("-c*r*abs(r)", "-c*v/r"), "no finite value"),
        (("-c*r*abs(r)", "r*abs(r)"), "parameters.c: no formula speaks of it"),
        (("-c*r*abs(r)", "r + 0*c"), "is still"),
        (("{yaw:", "{roll:"), "'roll'"),
        (("low: -1", "low: 0.1"), "0 must lie between low and high of c"),
        (("low: -1", "low: 5"), "parameters.c: low must be less"),
        (("low: -1", "low: .nan"), "parameters.c.low"),
        (("steps: [0.5]", "steps: [9]"), "must lie between low and high"),
        (("steps: [0.5]", "steps: []"), "parameters.c.steps"),
        (("  c:", "  r:"), "already stands for something else"),
        (("  c:", "  c c:"), "is no name of a parameter"),
        (("terms:", "states: {m2: {derivative: '0'}}\nterms:"), "states are numbered through"),
        (("terms:", "states: {m1: {derivative: 'q'}}\nterms:"), "states.m1.derivative"),
        (("terms:", "needs: [barometer]\nterms:"), "barometer"),
        (("terms:", "code: print(1)\nterms:"), "code: there is no such key"),
        (("terms:", "more: !!python/object/apply:os.system [ls]\nterms:"), "not valid YAML"),
        (("terms:", "more: &a [*a]\nterms:"), "once its aliases are written out"),
        (("terms: {", "terms: {{"), "not valid YAML"),
        (("name: mine", "name: mine\nname: yours"), "'name' is written twice, in lines 2 and 3"),
        (("low: -1", "low: -1, low: -2"), "'low' is written twice, in lines 7 and 7"),
        (("terms:", "rudder_course: swing\nterms:"), "rudder_course: found 'swing', expected 'backlash', 'dead_time'"),
        (("terms:", "measured_by: [barometer]\nterms:"), "barometer"),
        (("terms:", "group: colour\nterms:"), "group: found 'colour', expected 'hull'"),
    ],
)
def test_a_wrong_effect_file_is_one_clear_error_with_file_and_key(change: tuple[str, str], message: str) -> None:
    assert change[0] in FILE
    with pytest.raises(UsageError) as caught:
        from_file(FILE.replace(*change), "mine.yaml")
    assert caught.value.code == "effect_file_invalid"
    assert caught.value.message.startswith("mine.yaml is not a valid effect file: ")
    assert message in caught.value.message


@pytest.mark.parametrize(
    "text", ["", "- a", "7", "[" * 2000, "- " * 2000, "? " * 2000, "a: {" * 2000, "\x00", "a: " + "x" * 60_000]
)
def test_what_is_no_effect_file(text: str) -> None:
    with pytest.raises(UsageError, match="is not a valid effect file"):
        from_file(text, "mine.yaml")
