"""Running a program: its value with derivatives, compiled once for all programs.

Every number carries its derivatives with respect to the states (forward differentiation: Griewank & Walther 2008,
"Evaluating Derivatives", ch. 3), so a term that a person writes reaches the filter with its exact linearisation and
without a compiler. Several sets of variables go through side by side, in lanes, innermost in memory: the processor
takes them at once, and what an instruction costs to look up is paid once for all.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.compiled import FILLING, njit
from kempf.pipeline.model.batch import each
from kempf.pipeline.model.terms.program import (
    ABS,
    ADD,
    CONSTANT,
    COS,
    DIVIDE,
    EXP,
    LOG,
    MIN,
    MOVING,
    MULTIPLY,
    NEGATE,
    POWER,
    SIGN,
    SIN,
    SQRT,
    SUBTRACT,
    VARIABLE,
)


@njit(**FILLING)
def evaluate(code, constants, values, slopes, stack, by, width, lanes):  # type: ignore[no-untyped-def]  # noqa: PLR0912 - loops over lanes
    """Run a program; the result with its derivatives stands in ``stack[0]``.

    Parameters
    ----------
    code, constants : ndarray
        Of a `Program`.
    values : ndarray, shape (n, lanes)
        Value of every variable.
    slopes : ndarray, shape (n, width, lanes)
        Its derivatives; those from `MOVING` on are taken for 0.
    stack : ndarray, shape (DEPTH, 1 + width, lanes)
        Room to work in.
    by : ndarray, shape (2, lanes)
        The same.
    width : int
        Derivatives that are carried.
    lanes : tuple
        See `kempf.pipeline.model.batch`.
    """
    top, carries = -1, 0
    for k in range(code.shape[0]):
        what, index = code[k, 0], code[k, 1]
        if what == CONSTANT:
            top += 1
            for b in range(each(lanes)):
                stack[top, 0, b] = constants[index]
            carries &= ~(1 << top)
        elif what == VARIABLE:
            top += 1
            for b in range(each(lanes)):
                stack[top, 0, b] = values[index, b]
            if index < MOVING:
                for j in range(width):
                    for b in range(each(lanes)):
                        stack[top, j + 1, b] = slopes[index, j, b]
                carries |= 1 << top
            else:
                carries &= ~(1 << top)
        elif what <= POWER or what >= MIN:
            top -= 1
            pair = (carries >> top) & 3
            _two(what, stack, by, top, width, pair & 1, pair & 2, lanes)
            if pair:
                carries |= 1 << top
        else:
            _one(what, stack, by, top, width, (carries >> top) & 1, lanes)
    if not carries & 1:
        for j in range(1, width + 1):
            for b in range(each(lanes)):
                stack[0, j, b] = 0.0


@njit(**FILLING)
# one branch an instruction, not split further: a call between them costs as much as they do
def _two(what, stack, by, top, width, from_left, from_right, lanes):  # type: ignore[no-untyped-def]  # noqa: PLR0912
    for b in range(each(lanes)):
        left, right = stack[top, 0, b], stack[top + 1, 0, b]
        by_left, by_right = 1.0, 1.0
        if what == ADD:
            value = left + right
        elif what == SUBTRACT:
            value, by_right = left - right, -1.0
        elif what == MULTIPLY:
            value, by_left, by_right = left * right, right, left
        elif what == DIVIDE:
            value = left / right
            by_left, by_right = 1.0 / right, -value / right
        elif what == POWER and right == 2.0:
            value, by_left, by_right = left * left, 2.0 * left, 0.0
        elif what == POWER and right == 3.0:
            # cubes are what hulls are written with: the general power takes twenty times as long
            value, by_left, by_right = left * left * left, 3.0 * left * left, 0.0
        elif what == POWER:
            # the exponent is a number: what is parsed has no other
            value, by_right = left**right, 0.0
            by_left = right * left ** (right - 1.0) if right != 0.0 else 0.0
        elif what == MIN:
            value, by_left, by_right = (left, 1.0, 0.0) if left <= right else (right, 0.0, 1.0)
        else:
            value, by_left, by_right = (left, 1.0, 0.0) if left >= right else (right, 0.0, 1.0)
        stack[top, 0, b], by[0, b], by[1, b] = value, by_left, by_right
    if from_left and from_right:
        for j in range(1, width + 1):
            for b in range(each(lanes)):
                stack[top, j, b] = by[0, b] * stack[top, j, b] + by[1, b] * stack[top + 1, j, b]
    elif from_left:
        for j in range(1, width + 1):
            for b in range(each(lanes)):
                stack[top, j, b] *= by[0, b]
    elif from_right:
        for j in range(1, width + 1):
            for b in range(each(lanes)):
                stack[top, j, b] = by[1, b] * stack[top + 1, j, b]


@njit(**FILLING)
def _one(what, stack, by, top, width, carries, lanes):  # type: ignore[no-untyped-def]  # noqa: PLR0912 - loops over lanes
    for b in range(each(lanes)):
        a = stack[top, 0, b]
        slope, value = 0.0, 0.0
        if what == NEGATE:
            value, slope = -a, -1.0
        elif what == ABS:
            value, slope = abs(a), np.sign(a)
        elif what == SIGN:
            value = np.sign(a)
        elif what == SIN:
            value, slope = np.sin(a), np.cos(a)
        elif what == COS:
            value, slope = np.cos(a), -np.sin(a)
        elif what == SQRT:
            value = np.sqrt(a)
            slope = 0.5 / value
        elif what == EXP:
            value = np.exp(a)
            slope = value
        elif what == LOG:
            value, slope = np.log(a), 1.0 / a
        else:
            value = np.tanh(a)
            slope = 1.0 - value * value
        stack[top, 0, b], by[0, b] = value, slope
    if carries:
        for j in range(1, width + 1):
            for b in range(each(lanes)):
                stack[top, j, b] *= by[0, b]
