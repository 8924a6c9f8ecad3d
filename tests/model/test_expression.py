"""Programs against what they stand for: values against a plain evaluation, derivatives against complex steps."""

from __future__ import annotations

import cmath
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from kempf.pipeline.model.terms import program
from kempf.pipeline.model.terms.expression import FUNCTIONS, compiled, names_in
from kempf.pipeline.model.terms.ordinary import run
from kempf.pipeline.model.terms.program import DEPTH
from kempf.schemas.errors import UsageError
from kempf.schemas.symbols import STATE_SYMBOLS, SYMBOLS

STATES = tuple(STATE_SYMBOLS)
INDEX = {name: i for i, name in enumerate(SYMBOLS)}
STEP = 1e-30


@dataclass(frozen=True)
class Tree:
    """A random formula, and the same as a function of complex numbers: built beside the parser, not by it."""

    text: str
    of: Callable[[dict[str, complex]], complex]


def variable(name: str) -> Tree:
    return Tree(name, lambda x: x[name])


def constant(value: float) -> Tree:
    return Tree(f"{value!r}", lambda _: complex(value))


def two(sign: str, a: Tree, b: Tree) -> Tree:
    act: dict[str, Callable[[complex, complex], complex]] = {
        "+": lambda p, q: p + q,
        "-": lambda p, q: p - q,
        "*": lambda p, q: p * q,
        # kept away from a division by zero
        "/": lambda p, q: p / (q * q + 1.5),
    }
    right = f"(({b.text})**2 + 1.5)" if sign == "/" else f"({b.text})"
    return Tree(f"({a.text}) {sign} {right}", lambda x: act[sign](a.of(x), b.of(x)))


def one(name: str, a: Tree) -> Tree:
    act: dict[str, tuple[str, Callable[[complex], complex]]] = {
        "-": ("-({})", lambda p: -p),
        "sin": ("sin({})", cmath.sin),
        "cos": ("cos({})", cmath.cos),
        "tanh": ("tanh({})", cmath.tanh),
        "exp": ("exp(tanh({}))", lambda p: cmath.exp(cmath.tanh(p))),
        "log": ("log(({})**2 + 1.0)", lambda p: cmath.log(p * p + 1.0)),
        "sqrt": ("sqrt(({})**2 + 1.0)", lambda p: cmath.sqrt(p * p + 1.0)),
        "abs": ("abs({})", lambda p: -p if p.real < 0.0 else p),
        "cube": ("({})**3", lambda p: p * p * p),
        "inverse": ("(({})**2 + 2.0)**-1.5", lambda p: (p * p + 2.0) ** -1.5),
    }
    text, function = act[name]
    return Tree(text.format(a.text), lambda x: function(a.of(x)))


def bound(name: str, a: Tree, b: Tree) -> Tree:
    def chosen(x: dict[str, complex]) -> complex:
        p, q = a.of(x), b.of(x)
        return p if (p.real <= q.real) == (name == "min") else q

    return Tree(f"{name}({a.text}, {b.text})", chosen)


LEAVES = st.one_of(
    st.sampled_from([*STATES, "V", "L"]).map(variable),
    st.floats(0.125, 8.0).map(lambda x: constant(round(x, 3))),
)
ONES = ["-", "sin", "cos", "tanh", "exp", "log", "sqrt", "abs", "cube", "inverse"]
TREES = st.recursive(
    LEAVES,
    lambda below: st.one_of(
        st.builds(two, st.sampled_from("+-*/"), below, below),
        st.builds(one, st.sampled_from(ONES), below),
        st.builds(bound, st.sampled_from(["min", "max"]), below, below),
    ),
    max_leaves=12,
)
NUMBERS = st.lists(st.floats(-2.0, 2.0).filter(lambda x: abs(x) > 1e-3), min_size=len(SYMBOLS), max_size=len(SYMBOLS))


@settings(max_examples=150, deadline=None, derandomize=True)
@given(TREES, NUMBERS)
def test_value_and_derivatives_are_those_of_the_function(tree: Tree, numbers: list[float]) -> None:
    values = np.array(numbers)
    point = {name: complex(values[i]) for name, i in INDEX.items()}
    expected = tree.of(point)
    size = abs(expected)
    if not np.isfinite(size) or size > 1e12:
        return
    found = run(compiled(tree.text, INDEX), values)
    assert found[0] == pytest.approx(expected.real, rel=1e-9, abs=1e-9)
    for k, name in enumerate(STATES):
        stepped = tree.of({**point, name: point[name] + 1j * STEP}).imag / STEP
        assert found[1 + k] == pytest.approx(stepped, rel=1e-7, abs=1e-7 * (1.0 + size)), tree.text


@settings(max_examples=100, deadline=None, derandomize=True)
@given(TREES)
def test_names_are_those_that_stand_in_it(tree: Tree) -> None:
    found = names_in(tree.text)
    assert len(found) == len(set(found))
    assert not set(found) & set(FUNCTIONS)
    compiled(tree.text, {name: i for i, name in enumerate(found)})


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("2 + 3*4", 14.0),
        ("(2 + 3)*4", 20.0),
        ("2 - 3 - 4", -5.0),
        ("-2**2", -4.0),
        ("(-2)**2", 4.0),
        ("12/4/3", 1.0),
        ("2*-3", -6.0),
        ("+5", 5.0),
        ("1.5e-3 + .5 + 2.", 2.5015),
        ("min(3, max(1, 2))", 2.0),
        ("sign(-3) + abs(-3)", 2.0),
        ("4**-0.5", 0.5),
        ("  \n 1 +\t1 ", 2.0),
        ("sqrt(9) + log(1) + exp(0) + cos(0) + tanh(0) + sin(0)", 5.0),
    ],
)
def test_the_rules_of_arithmetic_hold(text: str, value: float) -> None:
    assert run(compiled(text, INDEX), np.zeros(len(INDEX)))[0] == pytest.approx(value, abs=1e-15)


@pytest.mark.parametrize("text", ["v**0", "v**1", "v**2", "abs(v)", "v*abs(v)", "sign(v)", "abs(v)**3", "min(v, 0)"])
def test_slopes_at_zero_are_finite(text: str) -> None:
    assert np.all(np.isfinite(run(compiled(text, INDEX), np.zeros(len(INDEX)))))


def test_names_come_in_the_order_in_which_they_are_written() -> None:
    assert names_in("r*abs(v) + c*r - sin(k)") == ["r", "v", "c", "k"]


def test_as_deep_as_the_stack_and_no_deeper() -> None:
    def nested(levels: int) -> str:
        return "v + (" * levels + "v" + ")" * levels

    deepest = run(compiled(nested(DEPTH - 1), INDEX), np.ones(len(INDEX)))
    assert deepest[0] == DEPTH
    with pytest.raises(UsageError, match="is the most"):
        compiled(nested(DEPTH), INDEX)


def test_a_long_sum_is_no_deep_one() -> None:
    text = " + ".join(["v"] * 150)
    assert run(compiled(text, INDEX), np.full(len(INDEX), 2.0))[0] == 300.0


def test_the_place_of_a_mistake_is_named() -> None:
    with pytest.raises(UsageError, match="at character 8") as caught:
        compiled("  v +  rr", {"v": 0, "r": 1})
    assert caught.value.details["place"] == 8


@pytest.mark.parametrize(
    ("text", "once"),
    [
        ("min(v*r, r)**2 + min(v*r, r)**3", program.MIN),
        ("sin(v + r)*(sin(v + r) - cos(r*sin(v + r)))", program.SIN),
        ("r*(abs(v) + 1) + v*(abs(v) + 1)", program.ABS),
    ],
)
def test_what_a_formula_repeats_is_computed_once(text: str, once: int) -> None:
    values = np.linspace(0.3, 0.9, len(INDEX))
    made = compiled(text, INDEX)
    assert np.count_nonzero(made.code[:, 0] == once) == 1
    named = {name: float(values[k]) for name, k in INDEX.items()}
    by_python = eval(text, {"sin": np.sin, "cos": np.cos, "abs": abs, "min": min}, named)  # noqa: S307 - our own text
    assert run(made, values)[0] == pytest.approx(by_python, rel=1e-15)
    step = 1e-6
    for k in range(2):
        away = [run(made, values + sign * step * np.eye(values.size)[k])[0] for sign in (1, -1)]
        assert run(made, values)[1 + k] == pytest.approx((away[0] - away[1]) / (2 * step), rel=1e-7)


def test_parts_are_kept_only_where_the_stack_has_places_left() -> None:
    part = "sin(v + r)"
    text = part + " + (1" * (DEPTH - 4) + f" + {part}" + ")" * (DEPTH - 4)
    assert run(compiled(text, INDEX), np.zeros(len(INDEX)))[0] == DEPTH - 4
