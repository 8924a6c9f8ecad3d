"""Warnings and notes as a person meets them: the gravest first, those that say the same of several things once."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import click

from kempf.schemas.enumeration import counted
from kempf.workbench.terminal import one_line

#: how many are shown unless all are asked for
MOST = 3
#: what a warning is about, the gravest first; what none of them matches comes before the last
_GRAVEST = (
    "not converge|did not end|diverged",
    "not physical|unusual for a hull|wrong way|not observable",
    "at a bound|not determined|hardly determine",
    "linear model|simulated ship",
    "^channels|disagree|cannot be|could not|no zigzag|contradict",
    "not white|lie in their",
    "held out|no water log|wind_arm|no yaw rate",
)
_LEAST = "left out|is in [0-9]+ rows|not used|spikes"
_CHANNEL = re.compile(r"\b(yaw_rate|heading|lateral_speed|speed_through_water|rudder_angle)\b")
_NUMBER = re.compile(r"\d[\d.,e+-]*")


def ranked(warnings: Sequence[str]) -> list[str]:
    """Return warnings with the gravest first; those that differ in the channel or in numbers alone are grouped.

    Examples
    --------
    >>> ranked(["3 gross errors of heading left out", "2 gross errors of yaw_rate left out", "not converged: cycling"])
    ['not converged: cycling', '3 gross errors of heading left out (likewise yaw_rate)']
    """
    alike: dict[str, list[str]] = {}
    for warning in dict.fromkeys(warnings):
        alike.setdefault(_NUMBER.sub("#", _CHANNEL.sub("#", warning)), []).append(warning)
    grouped = [_joined(group) for group in alike.values()]
    return sorted(grouped, key=_rank)


def _joined(group: Sequence[str]) -> str:
    if len(group) == 1:
        return group[0]
    channels = [match.group() for warning in group if (match := _CHANNEL.search(warning))]
    others = [name for name in dict.fromkeys(channels) if name != channels[0]]
    return f"{group[0]} (likewise {', '.join(others)})" if others else f"{group[0]} (and {len(group) - 1} alike)"


def _rank(warning: str) -> int:
    if re.search(_LEAST, warning):
        return len(_GRAVEST) + 1
    ranks = [k for k, pattern in enumerate(_GRAVEST) if re.search(pattern, warning)]
    return ranks[0] if ranks else len(_GRAVEST)


def show_warnings(warnings: Sequence[str], *, verbose: bool, word: str = "warning") -> None:
    """Print the gravest warnings, or all of them one by one.

    Parameters
    ----------
    verbose : bool
        All, each for itself.
    word : str, optional
        What one of them is.
    """
    shown = list(warnings) if verbose else ranked(warnings)[:MOST]
    for warning in shown:
        click.echo(f"  {word}: {one_line(warning)[:600]}")
    more = 0 if verbose else len(ranked(warnings)) - len(shown)
    if more:
        click.echo(f"  {counted(more, f'more {word}')}: --verbose")


def of_several(notes: Mapping[str, Sequence[str]]) -> list[str]:
    """Return the notes of several files, each once with the files that it is about.

    Parameters
    ----------
    notes : mapping of str to sequence of str
        By the name of the file.
    """
    about: dict[str, list[tuple[str, str]]] = {}
    for name, sentences in notes.items():
        for note in dict.fromkeys(sentences):
            about.setdefault(_NUMBER.sub("#", note), []).append((name, note))
    return [
        f"{where[0][1]}" if len(notes) == 1 else f"in {_files([name for name, _ in where])}: {where[0][1]}"
        for where in about.values()
    ]


def _files(names: Sequence[str]) -> str:
    different = list(dict.fromkeys(names))
    return different[0] if len(different) == 1 else f"{len(different)} logs, such as {different[0]}"
