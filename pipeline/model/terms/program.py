"""The program of an expression, and its compiled evaluation with derivatives.

A program is a list of instructions in postfix order for a stack of numbers. Every number carries its derivatives with
respect to the states (forward differentiation: Griewank & Walther 2008, "Evaluating Derivatives", ch. 3), so a term
that a person writes reaches the filter with its exact linearisation and without a compiler.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pipeline.compiled import njit
from pipeline.model.terms.symbols import COMPUTED_SYMBOLS, STATE_SYMBOLS
from pipeline.normalise.series import Float

#: variables before this place may move with the states; ship, channels and parameters have no derivatives to carry
MOVING = len(STATE_SYMBOLS) + len(COMPUTED_SYMBOLS)
#: a program fills arrays and makes none: counting references to them would take longer than its arithmetic
_UNCOUNTED: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy", "_nrt": False}
#: deepest stack of a program; a bit for each place must fit into an integer
DEPTH = 24
#: instructions; the second number of an instruction is an index for the first two
CONSTANT, VARIABLE, ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, NEGATE = 0, 1, 2, 3, 4, 5, 6, 7
ABS, SIGN, SIN, COS, SQRT, EXP, LOG, TANH, MIN, MAX = 8, 9, 10, 11, 12, 13, 14, 15, 16, 17


@dataclass(frozen=True, eq=False)
class Program:
    """One expression, compiled.

    Attributes
    ----------
    code : ndarray of int64, shape (n, 2)
        Instructions and their indices.
    constants : ndarray, shape (m,)
        Numbers in the expression.
    """

    code: NDArray[np.int64]
    constants: Float


@njit(**_UNCOUNTED)
def evaluate(code, constants, values, slopes, stack, width):  # type: ignore[no-untyped-def]
    """Run a program; the result with its derivatives stands in ``stack[0]``.

    Parameters
    ----------
    code, constants : ndarray
        Of a `Program`.
    values : ndarray, shape (n,)
        Value of every variable.
    slopes : ndarray, shape (n, width)
        Its derivatives; those from `MOVING` on are taken for 0.
    stack : ndarray, shape (DEPTH, 1 + width)
        Room to work in.
    width : int
        Derivatives that are carried.
    """
    top, carries = -1, 0
    for k in range(code.shape[0]):
        what, index = code[k, 0], code[k, 1]
        if what == CONSTANT:
            top += 1
            stack[top, 0] = constants[index]
            carries &= ~(1 << top)
        elif what == VARIABLE:
            top += 1
            stack[top, 0] = values[index]
            if index < MOVING:
                for j in range(width):
                    stack[top, j + 1] = slopes[index, j]
                carries |= 1 << top
            else:
                carries &= ~(1 << top)
        elif what <= POWER or what >= MIN:
            top -= 1
            pair = (carries >> top) & 3
            _two(what, stack, top, width, pair & 1, pair & 2)
            if pair:
                carries |= 1 << top
        else:
            _one(what, stack, top, width, (carries >> top) & 1)
    if not carries & 1:
        for j in range(1, width + 1):
            stack[0, j] = 0.0


@njit(**_UNCOUNTED)
# one branch an instruction, not split further: a call between them costs as much as they do
def _two(what, stack, top, width, from_left, from_right):  # type: ignore[no-untyped-def]  # noqa: PLR0912
    a, b = stack[top, 0], stack[top + 1, 0]
    by_a, by_b, value = 1.0, 1.0, 0.0
    if what == ADD:
        value = a + b
    elif what == SUBTRACT:
        value, by_b = a - b, -1.0
    elif what == MULTIPLY:
        value, by_a, by_b = a * b, b, a
    elif what == DIVIDE:
        value = a / b
        by_a, by_b = 1.0 / b, -value / b
    elif what == POWER and b == 2.0:
        value, by_a, by_b = a * a, 2.0 * a, 0.0
    elif what == POWER:
        # the exponent is a number: what is parsed has no other
        value, by_b = a**b, 0.0
        by_a = b * a ** (b - 1.0) if b != 0.0 else 0.0
    elif what == MIN:
        value, by_a, by_b = (a, 1.0, 0.0) if a <= b else (b, 0.0, 1.0)
    else:
        value, by_a, by_b = (a, 1.0, 0.0) if a >= b else (b, 0.0, 1.0)
    stack[top, 0] = value
    if from_left and from_right:
        for j in range(1, width + 1):
            stack[top, j] = by_a * stack[top, j] + by_b * stack[top + 1, j]
    elif from_left:
        for j in range(1, width + 1):
            stack[top, j] *= by_a
    elif from_right:
        for j in range(1, width + 1):
            stack[top, j] = by_b * stack[top + 1, j]


@njit(**_UNCOUNTED)
def _one(what, stack, top, width, carries):  # type: ignore[no-untyped-def]
    a = stack[top, 0]
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
    stack[top, 0] = value
    if carries:
        for j in range(1, width + 1):
            stack[top, j] *= slope
