"""docs/fleet.md and prefect.yaml: what the page calls is there. The server itself is not started here."""

import ast
import re
from pathlib import Path

import yaml

ROOT = Path(__file__).parents[2]
TEXT = (ROOT / "docs" / "fleet.md").read_text(encoding="utf-8")
SETTINGS = yaml.safe_load((ROOT / "prefect.yaml").read_text(encoding="utf-8"))


def flows() -> dict[str, list[str]]:
    """Return the parameters of every flow in flows/fleet/flows.py by the flow's name, without importing Prefect."""
    tree = ast.parse((ROOT / "flows" / "fleet" / "flows.py").read_text(encoding="utf-8"))
    found = {}
    for node in tree.body:
        if isinstance(node, ast.FunctionDef) and any("flow" in ast.unparse(d) for d in node.decorator_list):
            found[node.name] = [argument.arg for argument in node.args.args]
    return found


def test_every_deployment_is_a_flow_and_its_parameters_are_the_flows() -> None:
    names = []
    for deployment in SETTINGS["deployments"]:
        # by the name under which workers of other folders find it, too: a file would be imported as `flows.fleet.flows`
        module, _, name = deployment["entrypoint"].rpartition(".")
        assert module == "kempf.flows.fleet.flows"
        assert set(deployment["parameters"]) <= set(flows()[name])
        assert f"{name}/{deployment['name']}" in TEXT
        assert deployment["parameters"]["warehouse"] == "{{ $KEMPF_WAREHOUSE }}"
        names.append(name)
    assert names == ["ingest", "reprocess", "diagnose"]


def test_the_page_names_the_pool_the_schedules_and_the_artifacts() -> None:
    pools = {deployment["work_pool"]["name"] for deployment in SETTINGS["deployments"]}
    assert pools == {"kempf"}
    assert "work-pool create kempf --type process" in TEXT
    assert "worker start --pool kempf" in TEXT
    crons = [[s["cron"] for s in deployment["schedules"]] for deployment in SETTINGS["deployments"]]
    assert crons == [["0 1 * * *"], ["0 2 * * *"], ["0 4 * * 0"]]
    assert "01:00 UTC and" in TEXT and "02:00 UTC every night" in TEXT and "04:00 UTC every Sunday" in TEXT
    source = (ROOT / "flows" / "fleet" / "flows.py").read_text(encoding="utf-8")
    keys = re.findall(r'create_table_artifact\(key="([\w-]+)"', source)
    assert sorted(keys) == ["kempf-diagnose", "kempf-identify", "kempf-ingest", "kempf-reprocess"]
    for key in keys:
        assert key in TEXT


def test_nothing_is_sent_away() -> None:
    for setting in ("DO_NOT_TRACK=1", "PREFECT_SERVER_ANALYTICS_ENABLED=false"):
        assert f"export {setting}" in TEXT
