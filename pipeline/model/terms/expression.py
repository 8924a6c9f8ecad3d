"""Reading an expression such as ``r*abs(r)``: Python's grammar, a short list of what may stand in it, no evaluation."""

from __future__ import annotations

import ast
import re
from collections.abc import Mapping
from difflib import get_close_matches

import numpy as np

from kempf.pipeline.model.terms import program
from kempf.pipeline.model.terms.program import DEPTH, Program
from kempf.schemas.enumeration import counted
from kempf.schemas.errors import UsageError

_LONGEST = 4000
_DEEPEST = 60
#: levels of the parsed tree: a sum of n terms has n of them, and Python's own stack must hold them all
_MOST_LEVELS = 200
_SHOWN = 80
#: all that a formula is written with; whatever else there is to Python is refused before its parser sees it
_TOKEN = re.compile(r"\s+|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?(?![\w.])|[A-Za-z_]\w*|\*\*|[-+*/(),]", re.ASCII)
_LARGEST_POWER = 9.0
_BINARY = {
    ast.Add: program.ADD,
    ast.Sub: program.SUBTRACT,
    ast.Mult: program.MULTIPLY,
    ast.Div: program.DIVIDE,
    ast.Pow: program.POWER,
}
#: what a person may have written that is no formula
_WORDS: dict[type[ast.expr], str] = {
    ast.Lambda: "a function of your own",
    ast.IfExp: "if",
    ast.BoolOp: "and, or",
    ast.Compare: "a comparison",
    ast.Tuple: "a comma outside a function",
    ast.Starred: "a star before an argument",
    ast.BinOp: "this operation",
    ast.UnaryOp: "this operation",
    ast.Constant: "True, False or None",
    ast.Call: "a call of a result",
    ast.Yield: "yield",
    ast.Await: "await",
}
#: functions by name: instruction and number of arguments
FUNCTIONS = {
    "abs": (program.ABS, 1),
    "sign": (program.SIGN, 1),
    "sin": (program.SIN, 1),
    "cos": (program.COS, 1),
    "sqrt": (program.SQRT, 1),
    "exp": (program.EXP, 1),
    "log": (program.LOG, 1),
    "tanh": (program.TANH, 1),
    "min": (program.MIN, 2),
    "max": (program.MAX, 2),
}


def names_in(text: str) -> list[str]:
    """Return the variables of an expression in the order in which they appear first; functions are none of them.

    Raises
    ------
    UsageError
        ``expression_invalid``.
    """
    tree = _parsed(text)
    called = {node.func for node in ast.walk(tree) if isinstance(node, ast.Call)}
    nodes = [node for node in ast.walk(tree) if isinstance(node, ast.Name) and node not in called]
    return list(dict.fromkeys(n.id for n in sorted(nodes, key=lambda n: (n.lineno, n.col_offset))))


def compiled(text: str, variables: Mapping[str, int]) -> Program:
    """Compile an expression.

    Parameters
    ----------
    text : str
        Numbers, variables, ``+ - * / **``, parentheses and the functions abs, sign, sin, cos, sqrt, exp, log, tanh,
        min, max.
    variables : mapping
        Index of every variable that may stand in it.

    Raises
    ------
    UsageError
        ``expression_invalid``: it holds something else; the message says what and where.
    """
    tree = _parsed(text).body
    writing = _Writing(text, variables)
    writing.write(tree, 0)
    if writing.deepest > DEPTH:
        raise _wrong(text, None, f"it is nested {writing.deepest} deep, {DEPTH} is the most")
    kept = _worth_keeping(tree, DEPTH - writing.deepest)
    if kept:
        writing = _Writing(text, variables, kept)
        writing.write(tree, 0)
    code = np.array(writing.code, dtype=np.int64).reshape(-1, 2)
    return Program(code, np.array(writing.constants, dtype=np.float64))


def _worth_keeping(tree: ast.expr, places: int) -> dict[ast.expr, int]:
    """Return the nodes whose like a formula repeats, and the places above its stack where what they give is kept.

    A cross-flow drag asks eight times for the speed of the bow: it is computed once.
    """
    number, size = _numbered(tree)
    alike: dict[int, list[ast.expr]] = {}
    row = [tree]
    while row:
        node = row.pop()
        nodes = alike.setdefault(number[node], [])
        nodes.append(node)
        if len(nodes) == 1:
            # what stands in a repetition is not computed again
            row += [below for below in ast.iter_child_nodes(node) if isinstance(below, ast.expr)][::-1]
    # to keep it costs an instruction, and every time it is asked for again another
    gain = {k: (len(nodes) - 1) * (size[nodes[0]] - 1) - 1 for k, nodes in alike.items()}
    best = sorted((k for k, saved in gain.items() if saved > 0), key=lambda k: (-gain[k], k))
    place = {k: DEPTH - 1 - at for at, k in enumerate(best[:places])}
    return {node: place[k] for node, k in number.items() if k in place and isinstance(node, ast.expr)}


def _numbered(tree: ast.expr) -> tuple[dict[ast.AST, int], dict[ast.AST, int]]:
    """Return a number for every node of a tree, equal for those written alike, and the instructions that each takes."""
    number: dict[ast.AST, int] = {}
    size: dict[ast.AST, int] = {}
    known: dict[object, int] = {}

    def visit(node: ast.AST) -> None:
        below = list(ast.iter_child_nodes(node))
        for child in below:
            visit(child)
        own = tuple(repr(value) for _, value in ast.iter_fields(node) if not isinstance(value, ast.AST | list))
        number[node] = known.setdefault((type(node), own, tuple(number[child] for child in below)), len(known))
        # the name of a function is no instruction of its own
        size[node] = isinstance(node, ast.expr) - isinstance(node, ast.Call) + sum(size[child] for child in below)

    visit(tree)
    return number, size


def _parsed(text: str) -> ast.Expression:
    if not isinstance(text, str):
        raise _wrong(repr(text), None, "it is no text")
    if len(text) > _LONGEST:
        raise _wrong(text, None, f"it is {len(text)} characters long, {_LONGEST} is the most")
    text = re.sub(r"\s", " ", text, flags=re.ASCII).rstrip()
    if not text:
        raise _wrong(text, None, "it is empty")
    _check_tokens(text)
    depth = deepest = 0
    for letter in text:
        depth += (letter == "(") - (letter == ")")
        deepest = max(deepest, depth)
    if deepest > _DEEPEST:
        raise _wrong(text, None, f"its parentheses are nested {deepest} deep, {_DEEPEST} is the most")
    blank = len(text) - len(text.lstrip())
    try:
        tree = ast.parse(text.lstrip(), mode="eval")
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        place = getattr(error, "offset", None)
        raise _wrong(text, place and place + blank, "it is no formula") from error
    if _levels(tree) > _MOST_LEVELS:
        raise _wrong(text, None, f"its operations are nested more than {_MOST_LEVELS} deep")
    for node in ast.walk(tree):
        if isinstance(node, ast.expr):
            node.col_offset += blank
    return tree


def _check_tokens(text: str) -> None:
    place = 0
    while place < len(text):
        token = _TOKEN.match(text, place)
        if token is None:
            raise _wrong(text, place + 1, f"{text[place]!r} may not stand in a formula there")
        place = token.end()


def _levels(tree: ast.AST) -> int:
    """Count the levels of a tree without recursion."""
    levels, row = 0, [tree]
    while row and levels <= _MOST_LEVELS:
        row = [below for node in row for below in ast.iter_child_nodes(node)]
        levels += 1
    return levels


class _Writing:
    """The instructions of a formula as they are written."""

    def __init__(self, text: str, variables: Mapping[str, int], kept: Mapping[ast.expr, int] | None = None) -> None:
        self.text, self.variables, self.kept = text, variables, kept or {}
        self.code: list[tuple[int, int]] = []
        self.constants: list[float] = []
        #: the highest the stack stands on the way
        self.deepest = 0
        self._there: set[int] = set()

    def write(self, node: ast.expr, height: int) -> None:
        """Append the instructions of a node whose result stands at a height of the stack."""
        self.deepest = max(self.deepest, height + 1)
        if height >= DEPTH:
            return
        place = self.kept.get(node)
        if place is not None and place in self._there:
            self.code.append((program.RECALL, place))
            return
        self._write(node, height)
        if place is not None:
            self._there.add(place)
            self.code.append((program.KEEP, place))

    def _write(self, node: ast.expr, height: int) -> None:
        if isinstance(node, ast.Constant) and type(node.value) in (int, float):
            self.code.append((program.CONSTANT, len(self.constants)))
            self.constants.append(_number(node, self.text))
        elif isinstance(node, ast.Name):
            if node.id not in self.variables:
                raise _unknown(node.id, node.col_offset, self.text, [*self.variables, *FUNCTIONS])
            self.code.append((program.VARIABLE, self.variables[node.id]))
        elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub | ast.UAdd):
            self.write(node.operand, height)
            if isinstance(node.op, ast.USub):
                self.code.append((program.NEGATE, 0))
        elif isinstance(node, ast.BinOp) and type(node.op) in _BINARY:
            if isinstance(node.op, ast.Pow):
                _check_power(node, self.text)
            self.write(node.left, height)
            self.write(node.right, height + 1)
            self.code.append((_BINARY[type(node.op)], 0))
        elif isinstance(node, ast.Call) and isinstance(node.func, ast.Name):
            self._write_call(node, node.func.id, height)
        else:
            phrase = _WORDS.get(type(node), "this")
            raise _wrong(self.text, node.col_offset + 1, f"{phrase} may not stand in a formula")

    def _write_call(self, node: ast.Call, name: str, height: int) -> None:
        if name not in FUNCTIONS:
            raise _unknown(name, node.col_offset, self.text, list(FUNCTIONS))
        instruction, count = FUNCTIONS[name]
        if len(node.args) != count or node.keywords:
            raise _wrong(self.text, node.col_offset + 1, f"{name} takes {counted(count, 'argument')}")
        for k, argument in enumerate(node.args):
            self.write(argument, height + k)
        self.code.append((instruction, 0))


def _number(node: ast.Constant, text: str) -> float:
    try:
        value = float(node.value)  # type: ignore[arg-type]
    except OverflowError:
        value = np.inf
    if not np.isfinite(value):
        raise _wrong(text, node.col_offset + 1, "a number in it is beyond what a computer holds")
    return value


def _check_power(node: ast.BinOp, text: str) -> None:
    exponent = node.right
    if isinstance(exponent, ast.UnaryOp):
        exponent = exponent.operand
    if not (isinstance(exponent, ast.Constant) and type(exponent.value) in (int, float)):
        raise _wrong(text, node.right.col_offset + 1, "the exponent of ** must be a number")
    if abs(_number(exponent, text)) > _LARGEST_POWER:
        raise _wrong(text, node.right.col_offset + 1, f"the exponent of ** may be {_LARGEST_POWER:g} at most")


def _unknown(name: str, column: int, text: str, known: list[str]) -> UsageError:
    shown = _short(name)
    close = get_close_matches(shown, known, n=1)
    hint = f"; did you mean {close[0]!r}? " if close else ". "
    return _wrong(text, column + 1, f"{shown!r} is not known{hint}Known are {', '.join(sorted(known))}")


def _short(text: str) -> str:
    return text if len(text) <= _SHOWN else text[:_SHOWN] + "..."


def _wrong(text: str, place: int | None, why: str) -> UsageError:
    where = f" at character {place}" if place else ""
    return UsageError(
        "expression_invalid",
        f"The expression {_short(text)!r} cannot be used{where}: {why}.",
        "Write a formula such as 'yaw: r*abs(r)'; `kempf effects show --symbols` lists what may stand in it.",
        {"expression": _short(text), "place": place},
    )
