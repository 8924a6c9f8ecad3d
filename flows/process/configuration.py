"""The settings of this process: an environment variable goes before the file ``kempf.toml``."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, get_args

from kempf.schemas.errors import NotFound, UsageError
from kempf.schemas.settings import VARIABLES, LogLevel

if TYPE_CHECKING:
    from kempf.schemas.configuration import Configuration

#: Variable that names the file, and its name where nobody names one.
FILE_VARIABLE, FILE = "KEMPF_CONFIG", "kempf.toml"
#: Folder of the warehouse where nobody names one.
DEFAULT_WAREHOUSE = "kempf-data"


@dataclass(frozen=True)
class SettingInForce:
    """One setting as it is in force."""

    name: str
    #: None where nothing sets it.
    value: str | None
    #: The variable or the file that sets it; None where nothing does.
    source: str | None

    def as_json(self) -> dict[str, str | None]:
        """Return the setting as JSON content."""
        return dict(vars(self))


def setting(name: str) -> str | None:
    """Return a setting, None where nothing sets it.

    Parameters
    ----------
    name : str
        Of `schemas.settings.VARIABLES`.

    Raises
    ------
    NotFound
        ``no_configuration``: the file that is named is not there.
    UsageError
        ``configuration_invalid``, ``secret_in_configuration``, ``log_level_unknown``.
    """
    return in_force(name).value


def configured_warehouse() -> str:
    """Return the address of the warehouse that is set, else the default one; errors are those of `setting`."""
    return setting("warehouse") or DEFAULT_WAREHOUSE


def log_level() -> str | None:
    """Return from which level on something is logged, None where nothing sets it; errors are those of `setting`."""
    level = in_force("log_level")
    if level.value is not None and level.value not in get_args(LogLevel):
        raise UsageError(
            "log_level_unknown",
            f"{level.source} sets the log level {level.value!r}; expected one of {', '.join(get_args(LogLevel))}.",
            "Give one of these.",
            {"found": level.value},
        )
    return level.value


def in_force(name: str) -> SettingInForce:
    """Return a setting with what sets it; the parameters and errors are those of `setting`."""
    variable = VARIABLES[name]
    if os.environ.get(variable):
        return SettingInForce(name, os.environ[variable], variable)
    path = file_of()
    if path is None:
        return SettingInForce(name, None, None)
    from kempf.schemas.configuration import value_of

    value = value_of(_read(path), name)
    return SettingInForce(name, value, str(path) if value is not None else None)


def every() -> list[SettingInForce]:
    """Return all settings; errors are those of `setting`."""
    return [in_force(name) for name in VARIABLES]


def _read(path: Path) -> Configuration:
    """Return what a file says."""
    # what most commands do without: they have no file
    import tomllib

    from kempf.schemas.configuration import parse

    try:
        content = tomllib.loads(path.read_text(encoding="utf-8"))
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise UsageError(
            "configuration_invalid",
            f"{path} is no TOML text: {error}.",
            'Write a line a setting, such as warehouse = "/data/kempf".',
            {"path": str(path)},
        ) from error
    except OSError as error:
        raise UsageError(
            "configuration_unreadable",
            f"{path} cannot be read: {error.strerror or error}.",
            f"Look at its permissions, or name another file with {FILE_VARIABLE}.",
            {"path": str(path)},
        ) from error
    return parse(content, str(path))


def file_of() -> Path | None:
    """Return the file that is in force, None where there is none; raises ``no_configuration``."""
    named = os.environ.get(FILE_VARIABLE)
    if named:
        path = Path(named).expanduser()
        if not path.is_file():
            raise NotFound(
                "no_configuration",
                f"{FILE_VARIABLE} names {named!r}, which is no file.",
                f"Write the file, or unset {FILE_VARIABLE}.",
                {"path": named},
            )
        return path
    home = os.environ.get("XDG_CONFIG_HOME") or "~/.config"
    places = (Path(FILE), Path(home).expanduser() / "kempf" / FILE)
    return next((place.absolute() for place in places if place.is_file()), None)
