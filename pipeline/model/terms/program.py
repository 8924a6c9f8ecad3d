"""The program of an expression: instructions in postfix order for a stack of numbers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from kempf.pipeline.channels.series import Float
from kempf.schemas.symbols import COMPUTED_SYMBOLS, STATE_SYMBOLS

#: variables before this place may move with the states; ship, channels and parameters have no derivatives to carry
MOVING = len(STATE_SYMBOLS) + len(COMPUTED_SYMBOLS)
#: deepest stack of a program; a bit for each place must fit into an integer
DEPTH = 24
#: instructions; the second number of an instruction is an index for the first two, and a place for the last
CONSTANT, VARIABLE, ADD, SUBTRACT, MULTIPLY, DIVIDE, POWER, NEGATE = 0, 1, 2, 3, 4, 5, 6, 7
ABS, SIGN, SIN, COS, SQRT, EXP, LOG, TANH, MIN, MAX = 8, 9, 10, 11, 12, 13, 14, 15, 16, 17
#: copy the top of the stack to a place above all that is worked with, and a place to the top
KEEP, RECALL = 18, 19


@dataclass(frozen=True, eq=False)
class Program:
    """One expression, compiled."""

    #: Shape (n, 2). Instructions and their indices.
    code: NDArray[np.int64]
    #: Shape (m,). Numbers in the expression.
    constants: Float
