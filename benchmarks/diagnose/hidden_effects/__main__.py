"""The whole benchmark by one command: ``python -m benchmarks.diagnose.hidden_effects --work DIR``.

A process of its own writes the cases and seals the answers; then they are diagnosed; the seal is opened last. Every
stage goes on where it was interrupted.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

from benchmarks.diagnose.hidden_effects import examine, score


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--work", type=Path, default=Path("hidden-effects-work"))
    parser.add_argument("--cases", type=int, default=336)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--at-most", type=int, help="diagnose so many of them")
    parser.add_argument("--rows-hz", type=float, help="all logs are tables of so many rows a second")
    given = parser.parse_args()
    root, answers, key = given.work / "sealed", given.work / "answers", given.work / "answer.key"
    given.work.mkdir(parents=True, exist_ok=True)
    if not (root / "sealed.bin").exists():
        own = [sys.executable, "-m", "benchmarks.diagnose.hidden_effects.write", "--out", str(root), "--key", str(key)]
        rows = ["--rows-hz", str(given.rows_hz)] if given.rows_hz else []
        subprocess.run([*own, "--cases", str(given.cases), "--seed", str(given.seed), *rows], check=True)
    limit = ["--at-most", str(given.at_most)] if given.at_most else []
    examine.main(["--cases", str(root / "cases"), "--out", str(answers), *limit])
    score.main(["--cases", str(root), "--answers", str(answers), "--key", str(key)])


if __name__ == "__main__":
    main()
