"""How large the house is: ``python -m benchmarks.documents.house [--before REV]``.

Lines and files by folder, the largest file, class names defined twice, and how many modules a reader has to open to
follow one thing from end to end: those of `pipeline` and `schemas` that its entry imports, directly or through others.
"""

from __future__ import annotations

import argparse
import ast
import io
import subprocess
import tarfile
from collections import Counter
from collections.abc import Mapping
from pathlib import Path

from benchmarks import result_page

ROOMS = ("schemas", "pipeline", "warehouse", "flows", "workbench")
ASIDE = ("tests", "benchmarks")
#: the commit before the redesign, where its files are still called what they were
BEFORE = "13ec8f7"
#: what is followed, and the modules that it begins in, new name first
PATHS = {
    "a sentence to a reading": ("pipeline.ingest.nmea.decode",),
    "the likelihood": ("pipeline.estimate.likelihood", "pipeline.identify.likelihood"),
    "an effect screened and added": (
        "pipeline.diagnose.screening.forward_selection",
        "pipeline.diagnose.screening.staged",
    ),
}

Sources = Mapping[str, str]


def sources(revision: str) -> Sources:
    """Return the Python files of a revision by path; those of the working tree where it is empty."""
    root = Path(__file__).parents[2]
    if not revision:
        listed = subprocess.run(["git", "ls-files", "*.py"], cwd=root, capture_output=True, text=True, check=True)
        return {name: (root / name).read_text(encoding="utf-8") for name in listed.stdout.split()}
    archive = subprocess.run(["git", "archive", revision], cwd=root, capture_output=True, check=True).stdout
    found = {}
    with tarfile.open(fileobj=io.BytesIO(archive)) as tar:
        for member in tar:
            stream = tar.extractfile(member) if member.isfile() and member.name.endswith(".py") else None
            if stream is not None:
                found[member.name] = stream.read().decode()
    return found


def of_folder(files: Sources, folder: str) -> list[str]:
    """Return the files of one folder, a link to it counted once."""
    return [name for name in files if name.startswith(f"{folder}/")]


def lines_of(files: Sources, names: list[str]) -> int:
    """Return the lines of some files."""
    return sum(files[name].count("\n") for name in names)


def twice(files: Sources) -> list[str]:
    """Return the names of classes that the product defines more than once."""
    names: Counter[str] = Counter()
    for room in ROOMS:
        for name in of_folder(files, room):
            names.update(node.name for node in ast.parse(files[name]).body if isinstance(node, ast.ClassDef))
    return sorted(name for name, count in names.items() if count > 1)


def opened(files: Sources, entries: tuple[str, ...]) -> int:
    """Return how many modules of `pipeline` and `schemas` an entry leads to, itself one of them."""
    modules = {name.removesuffix(".py").removesuffix("/__init__").replace("/", "."): name for name in files}
    entry = next(one for one in entries if one in modules)
    seen, left = {entry}, [entry]
    while left:
        for node in ast.walk(ast.parse(files[modules[left.pop()]])):
            if not isinstance(node, ast.ImportFrom) or not node.module:
                continue
            base = node.module.removeprefix("kempf.")
            for name in (base, *(f"{base}.{alias.name}" for alias in node.names)):
                reached = name in modules and name.startswith(("pipeline.", "schemas.")) and name not in seen
                if reached and not modules[name].endswith("__init__.py"):
                    seen.add(name)
                    left.append(name)
    return len(seen)


def page(before: Sources, now: Sources) -> list[str]:
    """Lines of the page."""
    rows = []
    for folder in (*ROOMS, *ASIDE):
        cells = []
        for files in (before, now):
            names = of_folder(files, folder)
            cells += [f"{lines_of(files, names):,}", str(len(names))]
        rows.append([f"`{folder}/`", *cells])
    totals = []
    for files in (before, now):
        every = [name for room in ROOMS for name in of_folder(files, room)]
        totals += [f"**{lines_of(files, every):,}**", f"**{len(every)}**"]
    rows.insert(len(ROOMS), ["**the product**", *totals])
    facts = []
    for title, count in (("largest file of the product, lines", _largest), ("class names defined twice", _twice)):
        facts.append([title, count(before), count(now)])
    facts += [
        [f"modules to open: {what}", str(opened(before, entries)), str(opened(now, entries))]
        for what, entries in PATHS.items()
    ]
    return [
        *result_page.table(["folder", "lines before", "files", "lines now", "files"], rows),
        "",
        *result_page.table(["", "before", "now"], facts),
        "",
        "Modules to open are those of `pipeline` and `schemas` that the entry imports, directly or through others.",
    ]


def _largest(files: Sources) -> str:
    every = [name for room in ROOMS for name in of_folder(files, room)]
    name = max(every, key=lambda one: files[one].count("\n"))
    return f"{files[name].count(chr(10))} (`{name}`)"


def _twice(files: Sources) -> str:
    found = twice(files)
    return f"{len(found)}" + (f": {', '.join(found)}" if found else "")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--before", default=BEFORE, help="revision to compare with")
    options = parser.parse_args()
    lines = page(sources(options.before), sources(""))
    path = result_page.write("documents.house", f"The house, beside {options.before}", lines)
    print(path.read_text(encoding="utf-8"))


if __name__ == "__main__":
    main()
