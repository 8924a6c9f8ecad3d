"""The deployment file: it names a flow that is there, with parameters that the flow takes, and a time that comes."""

from __future__ import annotations

import inspect
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import yaml

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def deployments() -> list[dict[str, Any]]:
    content = yaml.safe_load((ROOT / "prefect.yaml").read_text(encoding="utf-8"))
    return list(content["deployments"])


def test_every_deployment_runs_a_flow_that_is_there(deployments: list[dict[str, Any]]):
    from prefect import Flow

    assert deployments
    for one in deployments:
        module, _, name = one["entrypoint"].rpartition(".")
        flow = getattr(import_module(module), name)
        assert isinstance(flow, Flow)
        parameters = inspect.signature(flow.fn).parameters
        assert set(one.get("parameters", {})) <= set(parameters)
        flow.validate_parameters(one.get("parameters", {}))


def test_the_schedules_are_valid(deployments: list[dict[str, Any]]):
    from prefect.client.schemas.schedules import CronSchedule

    schedules = [schedule for one in deployments for schedule in one.get("schedules", [])]
    assert any(one["entrypoint"] == "kempf.flows.fleet.flows.reprocess" and one["schedules"] for one in deployments)
    for schedule in schedules:
        assert CronSchedule(cron=schedule["cron"], timezone=schedule["timezone"]).cron == schedule["cron"]
    with pytest.raises(ValueError, match="cron"):  # the check can fail
        CronSchedule(cron="61 2 * * *", timezone="UTC")
