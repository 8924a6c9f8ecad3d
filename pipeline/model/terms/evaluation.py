"""Running a program: its value with derivatives, compiled once for all programs.

Every number carries its derivatives with respect to the states (forward differentiation: Griewank & Walther 2008,
"Evaluating Derivatives", ch. 3), so a term that a person writes reaches the filter with its exact linearisation and
without a compiler. Several sets of variables go through side by side, in lanes, innermost in memory: the processor
takes them at once, and what an instruction costs to look up is paid once for all.
"""

from __future__ import annotations

import numpy as np

from kempf.pipeline.compiled import FILLING, STEP, njit
from kempf.pipeline.model.batch import each
from kempf.pipeline.model.lanes import at, choose, put, root
from kempf.pipeline.model.terms.program import (
    ABS,
    ADD,
    CONSTANT,
    COS,
    DIVIDE,
    EXP,
    KEEP,
    LOG,
    MIN,
    MOVING,
    MULTIPLY,
    NEGATE,
    POWER,
    RECALL,
    SIGN,
    SIN,
    SQRT,
    SUBTRACT,
    VARIABLE,
)


@njit(**FILLING)
def evaluate(code, constants, columns, values, slopes, stack, by, lanes):  # type: ignore[no-untyped-def]  # noqa: PLR0912 - a branch an instruction
    """Run a program; the result stands in ``stack[0]``: its value first, then its derivatives, those of ``columns``.

    Parameters
    ----------
    code, constants : ndarray
        Of a `Program`.
    columns : ndarray of int64
        States that it may move with, or none where no derivatives are wanted; the other derivatives are left alone.
    values : ndarray, shape (n, lanes)
        Value of every variable.
    slopes : ndarray, shape (n, width, lanes)
        Its derivatives; those from `MOVING` on are taken for 0.
    stack : ndarray, shape (DEPTH, 1 + width, lanes)
        Room to work in.
    by : ndarray, shape (lanes,)
        The same.
    lanes : tuple
        See `kempf.pipeline.model.batch`.
    """
    top, carries = -1, 0
    for k in range(code.shape[0]):
        what, index = code[k, 0], code[k, 1]
        if what == CONSTANT:
            top += 1
            put(stack, (top, 0), constants[index], lanes)
            carries &= ~(1 << top)
        elif what == VARIABLE:
            top += 1
            put(stack, (top, 0), at(values, index, lanes), lanes)
            if index < MOVING:
                for j in columns:
                    put(stack, (top, j + 1), at(slopes, (index, j), lanes), lanes)
                carries |= 1 << top
            else:
                carries &= ~(1 << top)
        elif what == KEEP:
            carries = _copy(stack, top, index, columns, carries, lanes)
        elif what == RECALL:
            top += 1
            carries = _copy(stack, index, top, columns, carries, lanes)
        elif what <= POWER or what >= MIN:
            top -= 1
            pair = (carries >> top) & 3
            _two(what, stack, by, top, columns, pair & 1, pair & 2, lanes)
            if pair:
                carries |= 1 << top
        else:
            _one(what, stack, by, top, columns, (carries >> top) & 1, lanes)
    if not carries & 1:
        for j in columns:
            put(stack, (0, j + 1), 0.0, lanes)


@njit(**STEP)
def _copy(stack, place, to, columns, carries, lanes):  # type: ignore[no-untyped-def]
    """Copy a place of the stack to another; return which places carry derivatives."""
    put(stack, (to, 0), at(stack, (place, 0), lanes), lanes)
    if not (carries >> place) & 1:
        return carries & ~(1 << to)
    for j in columns:
        put(stack, (to, j + 1), at(stack, (place, j + 1), lanes), lanes)
    return carries | (1 << to)


@njit(**STEP)
# one branch an instruction, not split further: a call between them costs as much as they do
def _two(what, stack, by, top, columns, from_left, from_right, lanes):  # type: ignore[no-untyped-def]
    left, right = at(stack, (top, 0), lanes), at(stack, (top + 1, 0), lanes)
    if what == ADD:
        put(stack, (top, 0), left + right, lanes)
        _chain(stack, top, columns, from_left, from_right, 1.0, 1.0, lanes)
    elif what == SUBTRACT:
        put(stack, (top, 0), left - right, lanes)
        _chain(stack, top, columns, from_left, from_right, 1.0, -1.0, lanes)
    elif what == MULTIPLY:
        put(stack, (top, 0), left * right, lanes)
        _chain(stack, top, columns, from_left, from_right, right, left, lanes)
    elif what == DIVIDE:
        value = left / right
        put(stack, (top, 0), value, lanes)
        if columns.size > 0 and (from_left or from_right):
            _chain(stack, top, columns, from_left, from_right, 1.0 / right, -value / right, lanes)
    elif what == POWER:
        _to_power(stack, by, top, columns, from_left, lanes)
    else:
        a, b = (left, right) if what == MIN else (-left, -right)
        put(stack, (top, 0), choose(a, b, left, right), lanes)
        by_left, by_right = choose(a, b, 1.0, 0.0), choose(a, b, 0.0, 1.0)
        _chain(stack, top, columns, from_left, from_right, by_left, by_right, lanes)


@njit(**STEP)
def _to_power(stack, by, top, columns, from_left, lanes):  # type: ignore[no-untyped-def]
    # the exponent is a number: what is parsed has no other
    left, exponent = at(stack, (top, 0), lanes), stack[top + 1, 0, 0]
    if exponent == 2.0:
        put(stack, (top, 0), left * left, lanes)
        _chain(stack, top, columns, from_left, 0, 2.0 * left, 0.0, lanes)
    elif exponent == 3.0:
        # cubes are what hulls are written with: the general power takes twenty times as long
        put(stack, (top, 0), left * left * left, lanes)
        _chain(stack, top, columns, from_left, 0, 3.0 * left * left, 0.0, lanes)
    else:
        for b in range(each(lanes)):
            number = stack[top, 0, b]
            stack[top, 0, b] = number**exponent
            if from_left and columns.size > 0:
                by[b] = exponent * number ** (exponent - 1.0) if exponent != 0.0 else 0.0
        _chain(stack, top, columns, from_left, 0, at(by, (), lanes), 0.0, lanes)


@njit(**STEP)
def _one(what, stack, by, top, columns, carried, lanes):  # type: ignore[no-untyped-def]
    a = at(stack, (top, 0), lanes)
    if what == NEGATE:
        put(stack, (top, 0), -a, lanes)
        _chain(stack, top, columns, carried, 0, -1.0, 0.0, lanes)
    elif what in (ABS, SIGN):
        sign = choose(a, 0.0, choose(0.0, a, 0.0, -1.0), 1.0)
        put(stack, (top, 0), abs(a) if what == ABS else sign, lanes)
        _chain(stack, top, columns, carried, 0, sign if what == ABS else 0.0 * sign, 0.0, lanes)
    elif what == SQRT:
        value = root(a)
        put(stack, (top, 0), value, lanes)
        if columns.size > 0 and carried:
            _chain(stack, top, columns, carried, 0, 0.5 / value, 0.0, lanes)
    else:
        for b in range(each(lanes)):
            stack[top, 0, b], by[b] = _function(what, stack[top, 0, b])
        _chain(stack, top, columns, carried, 0, at(by, (), lanes), 0.0, lanes)


@njit(**STEP)
def _function(what, a):  # type: ignore[no-untyped-def]
    """Return the value of a function and its slope."""
    if what == SIN:
        return np.sin(a), np.cos(a)
    if what == COS:
        return np.cos(a), -np.sin(a)
    if what == EXP:
        value = np.exp(a)
        return value, value
    if what == LOG:
        return np.log(a), 1.0 / a
    value = np.tanh(a)
    return value, 1.0 - value * value


@njit(**STEP)
def _chain(stack, top, columns, from_left, from_right, by_left, by_right, lanes):  # type: ignore[no-untyped-def]
    """Multiply derivatives of operands by those of the operation with respect to them, and add them."""
    if from_left and from_right:
        for j in columns:
            left, right = at(stack, (top, j + 1), lanes), at(stack, (top + 1, j + 1), lanes)
            put(stack, (top, j + 1), by_left * left + by_right * right, lanes)
    elif from_left:
        for j in columns:
            put(stack, (top, j + 1), by_left * at(stack, (top, j + 1), lanes), lanes)
    elif from_right:
        for j in columns:
            put(stack, (top, j + 1), by_right * at(stack, (top + 1, j + 1), lanes), lanes)
