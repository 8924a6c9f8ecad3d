"""The program of an expression, and its compiled evaluation with derivatives.

A program is a list of instructions in postfix order for a stack of numbers. Every number carries its derivatives with
respect to the states (forward differentiation: Griewank & Walther 2008, "Evaluating Derivatives", ch. 3), so a term
that a person writes reaches the filter with its exact linearisation and without a compiler.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numba import njit
from numpy.typing import NDArray

from pipeline.normalise.series import Float

#: deepest stack of a program
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


@njit(cache=True, nogil=True, error_model="numpy")
def evaluate(code, constants, values, slopes, stack, width):  # type: ignore[no-untyped-def]
    """Run a program; the result with its derivatives stands in ``stack[0]``.

    Parameters
    ----------
    code, constants : ndarray
        Of a `Program`.
    values : ndarray, shape (n,)
        Value of every variable.
    slopes : ndarray, shape (n, width)
        Its derivatives.
    stack : ndarray, shape (DEPTH, 1 + width)
        Room to work in.
    width : int
        Derivatives that are carried.
    """
    top = -1
    for k in range(code.shape[0]):
        what, index = code[k, 0], code[k, 1]
        if what == CONSTANT:
            top += 1
            stack[top, 0] = constants[index]
            for j in range(1, width + 1):
                stack[top, j] = 0.0
        elif what == VARIABLE:
            top += 1
            stack[top, 0] = values[index]
            for j in range(width):
                stack[top, j + 1] = slopes[index, j]
        elif what <= POWER or what >= MIN:
            top -= 1
            _two(what, stack[top], stack[top + 1], width)
        else:
            _one(what, stack[top], width)


@njit(cache=True, nogil=True, error_model="numpy")
def _two(what, left, right, width):  # type: ignore[no-untyped-def]
    a, b = left[0], right[0]
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
    elif what == POWER:
        value = a**b
        by_a = b * a ** (b - 1.0) if b != 0.0 else 0.0
        # an exponent that is no function of the state needs no logarithm of a negative base
        by_b = value * np.log(a) if a > 0.0 else 0.0
    elif what == MIN:
        value, by_a, by_b = (a, 1.0, 0.0) if a <= b else (b, 0.0, 1.0)
    else:
        value, by_a, by_b = (a, 1.0, 0.0) if a >= b else (b, 0.0, 1.0)
    left[0] = value
    for j in range(1, width + 1):
        left[j] = by_a * left[j] + by_b * right[j]


@njit(cache=True, nogil=True, error_model="numpy")
def _one(what, number, width):  # type: ignore[no-untyped-def]
    a = number[0]
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
    number[0] = value
    for j in range(1, width + 1):
        number[j] *= slope
