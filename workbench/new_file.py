"""Files that a command writes: asked for before long work begins, so that it is not done for nothing; all are new."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from kempf.schemas.errors import UsageError
from kempf.warehouse.storage.whole_file import whole_file

_FIGURES = (".png", ".svg", ".pdf")


def require_new(path: Path, option: str) -> None:
    """Make sure that a file can be written and is not there yet.

    Parameters
    ----------
    option : str
        Option that named the file, for the message.

    Raises
    ------
    UsageError
        ``cannot_write``.
    """
    if path.exists() or path.is_symlink():
        raise _cannot_write(path, "it is there already", option)
    if not path.parent.is_dir():
        raise _cannot_write(path, f"there is no folder {path.parent}", option)


def require_figures(path: Path | None, count: int = 1, code: str = "figure_format") -> list[Path]:
    """Return the files that ``--figure`` names for so many figures, none of which is there yet.

    Parameters
    ----------
    path : Path or None
        The first file; the others have a number behind its name. None: no file.
    code : str, optional
        Of the error that a name with another ending is.

    Raises
    ------
    UsageError
        ``cannot_write``, or ``code``: it ends in none of .png, .svg and .pdf.
    """
    if path is None:
        return []
    if path.suffix not in _FIGURES:
        raise UsageError(code, f"--figure {path} ends in {path.suffix!r}; expected .png, .svg or .pdf.", "Rename it.")
    paths = [path if k == 0 else path.with_stem(f"{path.stem}-{k + 1}") for k in range(count)]
    for figure in paths:
        require_new(figure, "--figure")
    return paths


@contextmanager
def writing(path: Path, option: str = "--figure") -> Iterator[None]:
    """Say which option to change where writing a file fails.

    Raises
    ------
    UsageError
        ``cannot_write``.
    """
    try:
        yield
    except OSError as error:
        raise _cannot_write(path, error.strerror or str(error), option) from error


def write_new(path: Path, data: str | bytes) -> None:
    """Write the file that ``--output`` names and that is not there yet.

    Parameters
    ----------
    data : str or bytes
        Text is written as UTF-8.

    Raises
    ------
    UsageError
        ``cannot_write``: it is there, or cannot be written.
    """
    with writing(path, "--output"), path.open("xb") as stream:
        stream.write(data.encode() if isinstance(data, str) else data)


def _cannot_write(path: Path, why: str, option: str) -> UsageError:
    return UsageError(
        "cannot_write",
        f"Writing {path} failed: {why}.",
        f"Give another file with {option}; nothing is overwritten.",
    )


@contextmanager
def replaced(path: Path) -> Iterator[Path]:
    """Lend a file to write to, which takes the place of another once it is whole; the folder is made.

    Raises
    ------
    UsageError
        ``cannot_write``.
    """
    with writing(path, "FOLDER"), whole_file(path) as passing:
        yield passing
