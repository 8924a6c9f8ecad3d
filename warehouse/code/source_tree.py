"""Fingerprints of source code: what its modules do, whatever their comments and docstrings say.

Nothing is imported. A module counts by its syntax tree, without docstrings, in a form that is the same for every
version of Python. Which modules it imports is read from the same tree. A YAML file counts by what it says, without
comments and without the keys that the caller leaves out; any other file counts by its bytes. Parsing takes a second for
the whole source, so what was found in a file is kept by the hash of its bytes beside Python's own byte code, or in the
user's cache folder.
"""

from __future__ import annotations

import ast
import json
import os
from collections.abc import Collection, Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from importlib.util import cache_from_source, resolve_name
from pathlib import Path
from typing import Any

from kempf.schemas import yaml_text
from kempf.warehouse.storage.whole_file import whole_file

#: Name of the package, and the part of it that makes logs: a log counts by its own bytes.
_PACKAGE, _SIMULATOR = "kempf", "pipeline.simulate"
#: A module that imports one of these opens files beside it by name: all that lie in its folder count with it.
_BY_NAME = ("importlib", "pkgutil")
#: Of what is kept: the way in which a tree is written down, and how many files of which no more is asked may stay.
_FORM, _MOST_KEPT = 3, 4000


@dataclass(frozen=True)
class Module:
    """What one file of source does."""

    #: Of its syntax tree.
    digest: str
    #: Dotted names that may be modules, relative ones with their dots.
    imports: tuple[str, ...]
    #: Whether it opens files beside it by name.
    by_name: bool


def read_module(content: bytes) -> Module:
    """Return what a file of source does.

    Raises
    ------
    SyntaxError
        It is no source of this version of Python.
    """
    tree = ast.parse(content)
    names = tuple(sorted(set(_imported(tree))))
    by_name = any(name.partition(".")[0] in _BY_NAME for name in names)
    return Module(sha256(repr(_plain(tree)).encode()).hexdigest(), names, by_name)


def read_yaml(content: bytes, left_out: Collection[str] = ()) -> str:
    """Return the digest of what a YAML file says, in its order; of its bytes where it is not valid YAML.

    The order counts: that of an effect's parameters is the one of a set and of its covariance.

    Parameters
    ----------
    left_out : collection of str
        Keys that do not count, however deep they stand.
    """
    with suppress(yaml_text.NotYaml, TypeError):  # a key that is no text, number or truth value
        said = _without(yaml_text.load(content), left_out)
        content = json.dumps(said, default=repr).encode()
    return sha256(content).hexdigest()


def _without(value: Any, left_out: Collection[str]) -> Any:
    if isinstance(value, dict):
        return {key: _without(entry, left_out) for key, entry in value.items() if key not in left_out}
    return [_without(entry, left_out) for entry in value] if isinstance(value, list) else value


def _plain(node: Any) -> Any:
    """Return a syntax tree as lists and texts; fields that are empty are left out, as versions of Python add some."""
    if isinstance(node, ast.AST):
        fields = ((name, _plain(value)) for name, value in ast.iter_fields(node) if name not in ("ctx", "kind"))
        return [type(node).__name__, *((name, value) for name, value in fields if value not in ("None", []))]
    if isinstance(node, list):
        return [_plain(part) for part in node if not _is_remark(part)]
    return repr(node)


def _is_remark(node: Any) -> bool:
    """Return whether a node is a text that nothing is done with: a docstring."""
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant) and isinstance(node.value.value, str)


def _imported(node: ast.AST) -> Iterator[str]:
    if isinstance(node, ast.If) and isinstance(node.test, ast.Name) and node.test.id == "TYPE_CHECKING":
        for statement in node.orelse:
            yield from _imported(statement)
        return
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        base = "." * node.level + (node.module or "")
        yield base
        yield from (f"{base}{'' if base.endswith('.') else '.'}{alias.name}" for alias in node.names)
    for part in ast.iter_child_nodes(node):
        yield from _imported(part)


class SourceTree:
    """The source of some rooms of the package.

    Parameters
    ----------
    folder : Path
        Where the rooms lie.
    rooms : sequence of str
        Such as ``pipeline``; what is imported from elsewhere does not count.
    """

    def __init__(self, folder: Path, rooms: Iterable[str]) -> None:
        self._files = {_name(path, folder): path for room in rooms for path in sorted((folder / room).rglob("*.py"))}
        simulator = f"{_PACKAGE}.{_SIMULATOR}"
        self._files = {name: path for name, path in self._files.items() if not f"{name}.".startswith(f"{simulator}.")}
        self._folder = folder
        self._known = _Kept()

    @property
    def modules(self) -> tuple[str, ...]:
        """Dotted names of all modules, sorted."""
        return tuple(sorted(self._files))

    def reached(self, entries: Iterable[str], left_out: Collection[str] = ()) -> dict[str, str]:
        """Return the digests of some modules, of all that they import, and of the files that they open by name.

        Parameters
        ----------
        entries : iterable of str
            Dotted names.
        left_out : collection of str
            Keys of YAML files that do not count.

        Returns
        -------
        dict of str to str
            By dotted name of a module, or by path of another file.

        Raises
        ------
        ModuleNotFoundError
            An entry is not there.
        """
        todo = list(entries)
        for name in todo:
            if name not in self._files:
                raise ModuleNotFoundError(f"there is no module {name} in {self._folder}", name=name)
        digests: dict[str, str] = {}
        while todo:
            name = todo.pop()
            if name in digests or name not in self._files:
                continue
            path = self._files[name]
            module = self._known.module(path.read_bytes())
            digests[name] = module.digest
            package = name if path.stem == "__init__" else name.rpartition(".")[0]
            todo += [name.rpartition(".")[0], *(resolve_name(entry, package) for entry in module.imports)]
            if module.by_name:
                beside = [p for p in sorted(path.parent.rglob("*")) if p.is_file() and p.parent.name != "__pycache__"]
                todo += [_name(p, self._folder) for p in beside if p.suffix == ".py"]
                data = [p for p in beside if p.suffix != ".py"]
                digests |= {p.relative_to(self._folder).as_posix(): self._known.data(p, left_out) for p in data}
        self._known.keep()
        return digests


def _name(path: Path, folder: Path) -> str:
    parts = path.relative_to(folder).with_suffix("").parts
    return ".".join((_PACKAGE, *(parts[:-1] if parts[-1] == "__init__" else parts)))


class _Kept:
    """What was found in files before, by the hash of their bytes; for YAML with the keys that were left out."""

    def __init__(self) -> None:
        self._files: dict[str, Any] = {}
        self._new: dict[str, Any] = {}
        for place in _places():
            with suppress(OSError, ValueError, KeyError, TypeError):
                content = json.loads(place.read_text(encoding="utf-8"))
                if content["form"] == _FORM:
                    self._files |= content["files"]

    def module(self, content: bytes) -> Module:
        """Return what a file of source does; it is parsed where that is not known."""
        key = sha256(content).hexdigest()
        with suppress(KeyError, ValueError, TypeError):
            digest, imports, by_name = self._files[key]
            return Module(str(digest), tuple(imports), bool(by_name))
        module = read_module(content)
        self._new[key] = [module.digest, module.imports, module.by_name]
        return module

    def data(self, path: Path, left_out: Collection[str]) -> str:
        """Return the digest of a file that is no source; a YAML file is parsed where it is not known."""
        content = path.read_bytes()
        digest = sha256(content).hexdigest()
        if path.suffix != ".yaml":
            return digest
        key = " ".join((digest, *sorted(left_out)))
        known = self._files.get(key)
        if not isinstance(known, str):
            known = self._new[key] = read_yaml(content, left_out)
        return known

    def keep(self) -> None:
        """Write down what is new, at the first place that can be written to; nowhere is no harm."""
        if not self._new:
            return
        files = {**self._files, **self._new} if len(self._files) < _MOST_KEPT else self._new
        text = json.dumps({"form": _FORM, "files": files}, separators=(",", ":"))
        for place in _places():
            with suppress(OSError):
                with whole_file(place) as passing:
                    passing.write_text(text, encoding="utf-8")
                self._files, self._new = files, {}
                return


def _places() -> list[Path]:
    places = [Path(cache_from_source(__file__)).with_name("source_tree.json")]
    with suppress(RuntimeError):  # nobody's home is known
        places.append(Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / _PACKAGE / "source_tree.json")
    return places
