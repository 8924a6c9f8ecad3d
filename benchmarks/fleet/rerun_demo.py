"""The demonstration, then every parameter set of it rebuilt from the raw bytes, each in a new process."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from benchmarks import result_page

_KEMPF = "from kempf.workbench.cli import main; main()"


def kempf(*arguments: str) -> Any:
    """Run the command line in a new process and return its JSON."""
    command = [sys.executable, "-c", _KEMPF, *arguments, "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, cwd=Path(__file__).parents[2])
    return json.loads(done.stdout)


def main() -> None:
    with TemporaryDirectory() as name:
        folder = Path(name) / "demo"
        shown = kempf("demo", "--folder", str(folder))
        verdicts = [
            kempf("rerun", made["parameter_set_id"], "--warehouse", str(folder / "warehouse"))
            for made in shown["parameter_sets"]
        ]
    same = sum(v["verdict"] == "bit-identical" for v in verdicts)
    zigzags = sum(len(o["segments"]) for o in shown["ingested"])
    # ids are left out: they change with every line of code, and the page should change with the result alone
    rows = [
        [
            made["start"],
            "converged" if made["convergence"]["converged"] else f"not converged: {made['convergence']['reason']}",
            verdict["verdict"],
            ", ".join(difference["field"] for difference in verdict["differences"]),
        ]
        for made, verdict in zip(shown["parameter_sets"], verdicts, strict=True)
    ]
    lines = [
        f"{len(shown['ingested'])} raw logs (NMEA 0183, delimited text, MCAP), {zigzags} zigzags. "
        f"**Bit-identical: {same} of {len(verdicts)}.**",
        "",
        *result_page.table(["zigzag from", "search", "rebuilt in a new process", "fields that differ"], rows),
    ]
    path = result_page.write("fleet.rerun_demo", "Every parameter set of the demonstration rebuilt", lines)
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
