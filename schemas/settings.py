"""The names of what an installation sets, and the environment variables that set it."""

from __future__ import annotations

from typing import Literal

#: By name, the environment variable that goes before the file. That of lineage is OpenLineage's own.
VARIABLES = {
    "warehouse": "KEMPF_WAREHOUSE",
    "inbox": "KEMPF_INBOX",
    "dask": "KEMPF_DASK",
    "log_level": "KEMPF_LOG_LEVEL",
    "metrics.textfile": "KEMPF_METRICS_TEXTFILE",
    "metrics.pushgateway": "KEMPF_METRICS_PUSHGATEWAY",
    "lineage.url": "OPENLINEAGE_URL",
    "workbench.url": "KEMPF_WORKBENCH_URL",
}
LogLevel = Literal["debug", "info", "warning", "error"]
