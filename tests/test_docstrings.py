"""Every public thing is documented, and no documented argument is missing from its signature."""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
ROOMS = ("schemas", "pipeline", "warehouse", "flows", "workbench")
FILES = sorted(p.relative_to(ROOT).as_posix() for room in ROOMS for p in (ROOT / room).rglob("*.py"))

Function = ast.FunctionDef | ast.AsyncFunctionDef


def public(body: list[ast.stmt], prefix: str = "") -> Iterator[tuple[str, Function | ast.ClassDef]]:
    """Public functions, classes and methods; what stands inside a function is its own affair."""
    for node in body:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef, ast.ClassDef)) and not node.name.startswith("_"):
            yield prefix + node.name, node
            if isinstance(node, ast.ClassDef):
                yield from public(node.body, f"{prefix}{node.name}.")


def section(docstring: str, title: str) -> list[str]:
    """Names that a numpydoc section lists: ``a, b : float`` gives a and b."""
    lines = docstring.expandtabs().splitlines()
    indent = min((len(x) - len(x.lstrip()) for x in lines[1:] if x.strip()), default=0)
    lines = [lines[0].strip(), *(line[indent:] for line in lines[1:])]
    try:
        first = next(i for i in range(1, len(lines)) if lines[i - 1] == title and re.fullmatch(r"-{3,}", lines[i])) + 1
    except StopIteration:
        return []
    names: list[str] = []
    for i in range(first, len(lines)):
        if i + 1 < len(lines) and re.fullmatch(r"-{3,}", lines[i + 1]):
            break
        if lines[i] and not lines[i].startswith(" "):
            # several on a line: "x : float, shape (n,); y : float"
            for part in lines[i].split("; "):
                names += [name.strip().lstrip("*") for name in part.split(" : ")[0].split(",")]
    return names


def arguments(node: Function) -> set[str]:
    given = node.args
    named = [*given.posonlyargs, *given.args, *given.kwonlyargs, given.vararg, given.kwarg]
    return {a.arg for a in named if a is not None}


def fields(node: ast.ClassDef) -> set[str]:
    """Annotated and assigned names, properties and the arguments of ``__init__``."""
    found: set[str] = set()
    for item in node.body:
        if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name):
            found.add(item.target.id)
        elif isinstance(item, ast.Assign):
            found |= {t.id for t in item.targets if isinstance(t, ast.Name)}
        elif isinstance(item, (ast.FunctionDef, ast.AsyncFunctionDef)):
            found.add(item.name)
            if item.name == "__init__":
                found |= arguments(item)
    for inner in ast.walk(node):
        if isinstance(inner, ast.Attribute) and isinstance(inner.value, ast.Name) and inner.value.id == "self":
            found.add(inner.attr)
    return found


def faults(tree: ast.Module) -> Iterator[str]:
    if not ast.get_docstring(tree):
        yield "the module has no docstring"
    for name, node in public(tree.body):
        docstring = ast.get_docstring(node, clean=False)
        if not docstring:
            yield f"{name} has no docstring"
            continue
        inherited = isinstance(node, ast.ClassDef) and bool(node.bases)
        known = fields(node) if isinstance(node, ast.ClassDef) else arguments(node)
        titles = ("Parameters", "Attributes") if isinstance(node, ast.ClassDef) else ("Parameters",)
        for title in titles:
            for listed in section(docstring, title):
                if listed not in known and not inherited:
                    yield f"{name} documents {listed!r}, which it does not have"


@pytest.mark.parametrize("file", FILES)
def test_public_things_are_documented_and_documented_arguments_exist(file: str) -> None:
    assert list(faults(ast.parse((ROOT / file).read_text(encoding="utf-8")))) == []


def test_the_guard_sees_what_it_guards_against() -> None:
    wrong = '''"""A module."""

def bare(x): return x

def renamed(speed_m_s, *, step_s):
    """Do a thing.

    Parameters
    ----------
    speed_m_s, step_s : float
        Right.
    length_m : float
        Not there any more.

    Returns
    -------
    nothing : float
    """

class Table:
    """A table.

    Attributes
    ----------
    rows : int
    gone : int
    """

    rows: int
'''
    assert list(faults(ast.parse(wrong))) == [
        "bare has no docstring",
        "renamed documents 'length_m', which it does not have",
        "Table documents 'gone', which it does not have",
    ]
    assert list(faults(ast.parse("x = 1"))) == ["the module has no docstring"]
