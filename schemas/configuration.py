"""What an installation sets once: the file ``kempf.toml``, beside the environment variables of the same settings."""

from __future__ import annotations

from typing import Any

from pydantic import Field, ValidationError

from kempf.schemas.errors import UsageError
from kempf.schemas.faults import faults_of
from kempf.schemas.frozen import Frozen
from kempf.schemas.settings import VARIABLES, LogLevel


class Metrics(Frozen):
    """Where the figures of a run go, for Prometheus."""

    textfile: str | None = Field(default=None, description="folder that node_exporter's textfile collector reads")
    pushgateway: str | None = Field(default=None, description="address of a Pushgateway")


class Lineage(Frozen):
    """Where the OpenLineage events of a run go."""

    url: str | None = Field(default=None, description="address of a server that takes OpenLineage events")


class Workbench(Frozen):
    """Where the pages are that reports of runs link to."""

    url: str | None = Field(default=None, description="address at which `kempf workbench` is served")


class Configuration(Frozen):
    """The settings; None where nothing is said."""

    warehouse: str | None = Field(default=None, description="folder or s3://bucket/prefix where everything is kept")
    inbox: str | None = Field(default=None, description="folder or s3://bucket/prefix where logs arrive")
    dask: str | None = Field(default=None, description="address of a Dask scheduler whose workers share the batches")
    log_level: LogLevel | None = Field(default=None, description="from which level on a command says what it does")
    metrics: Metrics = Field(default_factory=Metrics, description="where the figures of a run go, for Prometheus")
    lineage: Lineage = Field(default_factory=Lineage, description="where the OpenLineage events of a run go")
    workbench: Workbench = Field(default_factory=Workbench, description="the pages that reports of runs link to")


def value_of(configuration: Configuration, name: str) -> str | None:
    """Return a setting by its name in `settings.VARIABLES`."""
    value: Any = configuration
    for part in name.split("."):
        value = getattr(value, part)
    return None if value is None else str(value)


def parse(content: dict[str, Any], where: str) -> Configuration:
    """Return the settings that the content of a file states.

    Parameters
    ----------
    where : str
        Address of the file, for the message.

    Raises
    ------
    UsageError
        ``configuration_invalid``: every fault is named with its place. ``secret_in_configuration``.
    """
    secret = [name for name in content if name.lower().startswith("aws_")]
    if secret:
        raise UsageError(
            "secret_in_configuration",
            f"{where} holds {', '.join(secret)}: credentials are read from the environment alone, and kept nowhere.",
            "Take them out of the file, and set them in the environment of whoever runs kempf.",
            {"path": where, "names": secret},
        )
    try:
        return Configuration.model_validate(content)
    except ValidationError as error:
        faults = faults_of(error, "file", content)
        raise UsageError(
            "configuration_invalid",
            f"{where} holds what is no setting: {'; '.join(faults)}.",
            f"Settings are {', '.join(VARIABLES)}; `kempf config` shows each with its value.",
            {"path": where, "faults": faults},
        ) from error
