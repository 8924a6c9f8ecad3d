"""Runs what a document shows: its console blocks in one shell and one folder, command after command.

A block whose fence says ``console`` holds commands behind ``$ `` and the output under each; a line ``...`` stands for
lines left out. One that says ``pycon`` holds Python behind ``>>> ``, with further lines of it behind ``... ``. A block
whose first line is a comment with a file's name, such as ``# ship.yaml``, is that file. Ids and hashes hang on the code
and are names here: the same one must stand for the same thing all through the document, also in the commands.
"""

from __future__ import annotations

import os
import re
import secrets
import subprocess
import sys
from dataclasses import dataclass, field
from itertools import takewhile
from pathlib import Path
from shlex import quote

from tests.docs.python_session import PythonSession

_FENCE = re.compile(r"^```(\w*)\s*$")
_PROMPTS = {"console": "$ ", "pycon": ">>> "}
_GOES_ON = "... "
_FILE = re.compile(r"^# ([\w-]+\.\w+)$")
_LEFT_OUT = "..."

_ID = r"(?:ps|seg|run|dx)-[0-9a-f]{8}(?:[0-9a-f]{8})?|(?=[0-9a-f]*\d)[0-9a-f]{12,64}(?:-dirty)?"
_NUMBER = r"(?<![\w.])[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?"
_PIECES = re.compile(rf"(?P<id>(?<![\w-])(?:{_ID})(?![\w]))|(?P<number>{_NUMBER})|(?P<blank>\s+)|(?P<other>.)")


@dataclass(frozen=True)
class Command:
    """One command with the output that the document shows."""

    #: What stands behind ``$ ``; of Python it may be several.
    line: str
    shown: tuple[str, ...]
    #: first, last: The shown output is ``lines[first:last]`` of the document.
    first: int
    last: int
    #: One of {"console", "pycon"}.
    kind: str = "console"

    def typed(self, line: str) -> list[str]:
        """Return a command as the document shows it, behind its prompts."""
        begin, *more = line.split("\n")
        return [_PROMPTS[self.kind] + begin, *(_GOES_ON + part for part in more)]


@dataclass(frozen=True)
class File:
    """A file that the document shows."""

    name: str
    content: str


def blocks(text: str) -> list[tuple[str, int, list[str]]]:
    """Return the fenced blocks of a document: what the fence says, number of the first line inside, lines."""
    found: list[tuple[str, int, list[str]]] = []
    kind: str | None = None
    for number, line in enumerate(text.splitlines()):
        fence = _FENCE.match(line)
        if kind is None and fence:
            kind = fence[1]
            found.append((kind, number + 1, []))
        elif fence:
            kind = None
        elif kind is not None:
            found[-1][2].append(line)
    return found


def steps(text: str) -> list[Command | File]:
    """Return the files and commands of a document in their order."""
    found: list[Command | File] = []
    for kind, first, lines in blocks(text):
        named = _FILE.match(lines[0]) if lines else None
        if named:
            found.append(File(named[1], "\n".join(lines) + "\n"))
        elif kind in _PROMPTS:
            prompt = _PROMPTS[kind]
            begins = [k for k, line in enumerate(lines) if line.startswith(prompt)]
            for begin, end in zip(begins, [*begins[1:], len(lines)], strict=True):
                more = list(takewhile(lambda text: text.startswith(_GOES_ON), lines[begin + 1 : end]))
                line = "\n".join([lines[begin].removeprefix(prompt), *(part.removeprefix(_GOES_ON) for part in more)])
                output = begin + 1 + len(more)
                found.append(Command(line, tuple(lines[output:end]), first + output, first + end, kind))
    return found


def environment() -> dict[str, str]:
    """Return what the commands of a page find in their environment."""
    kept = {k: v for k, v in os.environ.items() if not k.startswith(("KEMPF_", "PREFECT_"))}
    path = os.pathsep.join((str(Path(sys.executable).parent), os.environ.get("PATH", "")))
    return {**kept, "PATH": path, "NO_COLOR": "1", "PYTHONWARNINGS": "default"}


def sailed(folder: Path) -> str:
    """Return the line for the shell by which the log of the late ship is copied from ``folder``, not sailed again."""
    copied = " ".join(quote(str(folder / name)) for name in ("day.mcap", "late.yaml"))
    sails = "-m benchmarks.diagnose.late_rudder ."
    return f'python() {{ if [ "$*" = "{sails}" ]; then cp {copied} .; else command python "$@"; fi; }}'


class Shell:
    """One shell in a folder; what it exports and where it goes hold for the commands that follow."""

    def __init__(self, folder: Path) -> None:
        self._shell = subprocess.Popen(
            ["bash", "--noprofile", "--norc"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.STDOUT,
            text=True,
            cwd=folder,
            env=environment(),
        )

    def run(self, line: str) -> tuple[list[str], int]:
        """Run a command; return the lines it printed, stderr among them, and its exit code."""
        assert self._shell.stdin is not None
        assert self._shell.stdout is not None
        end = f"end-{secrets.token_hex(8)}"
        self._shell.stdin.write(f"{line}\nprintf '\\n%s %d\\n' {end} $?\n")
        self._shell.stdin.flush()
        printed: list[str] = []
        for said in self._shell.stdout:
            if said.startswith(end):
                break
            printed.append(said.rstrip())
        else:
            raise RuntimeError(f"the shell ended at: {line}")
        while printed and not printed[-1]:
            printed.pop()
        return printed, int(said.split()[1])

    def close(self) -> None:
        """End the shell."""
        self._shell.communicate("exit\n")


@dataclass
class Names:
    """Which real id stands for which one of the document."""

    real: dict[str, str] = field(default_factory=dict)

    def resolved(self, line: str) -> str:
        """Return a command of the document with the real ids in it."""
        return _PIECES.sub(lambda m: self.real.get(m[0], m[0]), line)


def follow(text: str, folder: Path, *before: str) -> int:
    """Run every command of a document in ``folder``, after those of ``before``; each must print what is shown.

    Returns
    -------
    int
        Commands of the document.
    """
    names, commands = Names(), 0
    sessions = sessions_in(folder)
    try:
        for line in before:
            sessions["console"].run(line)
        for step in steps(text):
            if isinstance(step, File):
                (folder / step.name).write_text(step.content, encoding="utf-8")
                continue
            commands += 1
            found, code = sessions[step.kind].run(names.resolved(step.line))
            assert code == 0, (step.line, found)
            why = difference(step.shown, found, names)
            assert why is None, f"{step.line}\n{why}\nrenew it with python -m benchmarks.documents.refresh_documents"
    finally:
        for session in sessions.values():
            session.close()
    return commands


def sessions_in(folder: Path) -> dict[str, Shell | PythonSession]:
    """Return what runs the commands of a document, by the kind of its blocks."""
    return {"console": Shell(folder), "pycon": PythonSession(folder)}


def difference(shown: tuple[str, ...], found: list[str], names: Names) -> str | None:
    """Say where the output differs from what the document shows; None where it does not.

    Parameters
    ----------
    shown : tuple of str
        Of the document, without its blank last lines; at most one ``...``.
    names : Names
        Learns which real id stands for which.
    """
    head, tail = _parts(shown)
    most = len(found) if tail is None else len(head) + len(tail)
    if len(found) < most or (tail is None and len(found) != len(head)):
        return f"{len(head)} lines are shown, {len(found)} came: {found}"
    pieces = [(head, found[: len(head)])] if head else []
    pieces += [(tail, found[len(found) - len(tail) :])] if tail else []
    for ours, theirs in pieces:
        left = list(theirs)
        for line in ours:
            # rows of one instant are sorted by their ids: the next row may stand before this one
            match = next((other for other in left[:2] if same_line(line, other, names)), None)
            if match is None:
                return f"shown: {line}\nfound: {left[0]}"
            left.remove(match)
    return None


def learn(shown: tuple[str, ...], found: list[str], names: Names) -> None:
    """Take over which real id stands for which, by their places in the output alone."""
    head, tail = _parts(shown)
    pairs = list(zip(head, found, strict=False))
    pairs += list(zip(tail, found[len(found) - len(tail) :], strict=False)) if tail else []
    for one, other in pairs:
        ours, theirs = ([m[0] for m in _PIECES.finditer(line) if m.lastgroup == "id"] for line in (one, other))
        for name, real in zip(ours, theirs, strict=False):
            names.real.setdefault(name, real)


def _parts(shown: tuple[str, ...]) -> tuple[tuple[str, ...], tuple[str, ...] | None]:
    while shown and not shown[-1]:
        shown = shown[:-1]
    if _LEFT_OUT not in shown:
        return shown, None
    at = shown.index(_LEFT_OUT)
    assert _LEFT_OUT not in shown[at + 1 :], "one ... in the output of a command"
    return shown[:at], shown[at + 1 :]


def same_line(shown: str, found: str, names: Names) -> bool:
    """Return whether two lines say the same.

    Blanks may be wider; whole numbers are equal; of others the last digit that both have may differ by one, and the
    seventh where they are longer.

    Examples
    --------
    >>> same_line("b2   6.315e-05", "b2  6.316e-05", Names())
    True
    >>> same_line("zigzags 6", "zigzags 7", Names())
    False
    """
    ours, theirs = ([m for m in _PIECES.finditer(line) if m.lastgroup != "blank"] for line in (shown, found))
    if [m.lastgroup for m in ours] != [m.lastgroup for m in theirs]:
        return False
    pairs = [(one.lastgroup, one[0], other[0]) for one, other in zip(ours, theirs, strict=True)]
    if not all(_close(a, b) if kind == "number" else kind == "id" or a == b for kind, a, b in pairs):
        return False
    ids = [(a, b) for kind, a, b in pairs if kind == "id"]
    if not all(names.real.get(a, b) == b for a, b in ids):
        return False
    names.real.update(ids)
    return True


def _close(shown: str, found: str) -> bool:
    if all(text.lstrip("+-").isdigit() for text in (shown, found)):
        return int(shown) == int(found)
    # numbers written to their last bit may move as far as another processor moves them
    unit = max(_last_digit(shown), _last_digit(found), 1e-6 * abs(float(shown)))
    return abs(float(shown) - float(found)) <= 1.001 * unit


def _last_digit(text: str) -> float:
    mantissa, _, exponent = text.partition("e")
    return 10.0 ** (int(exponent or 0) - len(mantissa.partition(".")[2]))


def renewed(command: Command, found: list[str]) -> list[str]:
    """Return the output as the document should show it: as many lines round its ``...`` as before."""
    head, tail = _parts(command.shown)
    blank = [""] if command.shown and not command.shown[-1] else []
    if tail is None or len(found) <= len(head) + len(tail):
        return [*found, *blank]
    return [*found[: len(head)], _LEFT_OUT, *found[len(found) - len(tail) :], *blank]
