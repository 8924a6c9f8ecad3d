"""The image of deploy/Dockerfile without a container engine: its steps as processes, a folder in the place of ``/``."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from numba.core.caching import _CacheLocator

from tests.scale.servers import ROOT, environment

DOCKERFILE = ROOT / "deploy" / "Dockerfile"
#: Settings of the image that are others here: what an import compiles by itself takes the tests half a minute for all.
_AS_A_TEST = {"UV_COMPILE_BYTECODE": "0"}
#: Folders of the image that a step or a service names.
_OF_THE_IMAGE = re.compile(r"(?<![\w/:.])/(?=(?:app|data|home|opt|src|tmp)\b)")


def instructions() -> list[tuple[str, str]]:
    """What the Dockerfile says, such as ``("COPY", "flows flows")``."""
    lines = [line for line in DOCKERFILE.read_text(encoding="utf-8").splitlines() if line and line[0] != "#"]
    assert not any(line.endswith("\\") for line in lines), "an instruction a line"
    return [(line.partition(" ")[0], line.partition(" ")[2]) for line in lines]


def copied() -> list[str]:
    """What the Dockerfile takes from the checkout."""
    taken = [rest.split() for word, rest in instructions() if word == "COPY" and not rest.startswith("--from=")]
    return [source for words in taken for source in words[:-1]]


@dataclass(frozen=True)
class Image:
    """What the steps have made."""

    root: Path
    #: What ENV says.
    settings: dict[str, str]

    def here(self, text: str) -> str:
        """Return a text with the image's folders in it as they are called on this machine."""
        return within(self.root, text)

    def environment(self, **more: str) -> dict[str, str]:
        """Return the environment of a process of the image: nothing of the checkout's."""
        plain = environment()
        del plain["PYTHONPATH"]
        own = {name: self.here(value).replace("$PATH", plain["PATH"]) for name, value in self.settings.items()}
        return {**plain, "HOME": self.here("/home/kempf"), **own, **{k: self.here(v) for k, v in more.items()}}

    @property
    def folder(self) -> Path:
        """Where its processes start."""
        return self.root / "app"


def within(root: Path, text: str) -> str:
    return _OF_THE_IMAGE.sub(f"{root}/", text)


def build(root: Path, given: Mapping[str, str]) -> Image:  # noqa: PLR0912 - a branch an instruction
    """Take the steps of the Dockerfile one after the other, with build arguments.

    Both stages share one folder. What only root of a container can do, the RUN of the last stage, makes folders alone.
    """
    settings: dict[str, str] = {}
    arguments: dict[str, str] = {}
    stages, at = 0, Path("/")
    for word, rest in instructions():
        here = root / at.relative_to("/")
        if word == "FROM":
            stages, at, settings, arguments = stages + 1, Path("/"), {}, {}
        elif word == "WORKDIR":
            at = Path(rest)
            (root / at.relative_to("/")).mkdir(parents=True, exist_ok=True)
        elif word == "ARG":
            name, _, default = rest.partition("=")
            arguments[name] = given.get(name, default.strip('"'))
        elif word == "ENV":
            name, _, value = rest.partition("=")
            settings[name] = _AS_A_TEST.get(name, value)
            if name == "NUMBA_CACHE_DIR" and stages == 1:
                _lay_kernels(root, Path(within(root, value)))
                # what a builder without them would compile is what the steps behind load
                arguments["NUMBA_DEBUG_CACHE"] = "1"
        elif word == "COPY" and rest.startswith("--from="):
            source, target = (one for one in rest.split() if not one.startswith("--"))
            assert source == target and (root / source.lstrip("/")).exists(), "it is there already: one folder for both"
        elif word == "COPY":
            *sources, target = rest.split()
            for source in sources:
                _copy(ROOT / source, here / target / Path(source).name if target.endswith("/") else here / target)
        elif word == "RUN" and stages == 1:
            kept = {name: within(root, value) for name, value in settings.items()}
            env = {k: v for k, v in environment(**arguments, **kept).items() if k not in ("PYTHONPATH", "VIRTUAL_ENV")}
            done = subprocess.run(
                ["sh", "-c", within(root, rest)], cwd=here, env=env, capture_output=True, text=True, check=False
            )
            assert done.returncode == 0, (rest, done.stdout, done.stderr)
            if "NUMBA_CACHE_DIR" in kept:
                _keep_used(Path(kept["NUMBA_CACHE_DIR"]), done.stdout)
        elif word == "RUN":
            for name in re.findall(r"(?<=\s)/data\S*", rest):
                Path(within(root, name)).mkdir(parents=True, exist_ok=True)
        else:
            assert word in ("USER", "CMD"), word
    for name in ("home/kempf", "tmp"):
        (root / name).mkdir(parents=True, exist_ok=True)
    return Image(root, settings)


def _lay_kernels(root: Path, folder: Path) -> None:
    """Put the kernels that the tests run on where the image's own are looked for, as a builder with a cache has them.

    They are found again by what went into them, so that only those whose code differs are compiled.
    """
    (package,) = root.glob("opt/kempf/lib/*/site-packages/kempf/pipeline")
    for kernel in (ROOT / "pipeline").rglob("*.nb[ic]"):
        there = package / kernel.parent.relative_to(ROOT / "pipeline").parent
        place = folder / _CacheLocator.get_suitable_cache_subpath(str(there / "any.py"))
        place.mkdir(parents=True, exist_ok=True)
        shutil.copy(kernel, place)


def _keep_used(folder: Path, said: str) -> None:
    """Take away the kernels that no step has used: an image built without a cache would not hold them."""
    used = set(re.findall(r"\[cache\] data (?:loaded from|saved to) '([^']+)'", said))
    assert used, said
    for kernel in folder.rglob("*.nbc"):
        if str(kernel) not in used:
            kernel.unlink()


def _copy(source: Path, target: Path) -> None:
    target.parent.mkdir(parents=True, exist_ok=True)
    if source.is_dir():
        shutil.copytree(source, target, symlinks=True, ignore=shutil.ignore_patterns("__pycache__"))
    else:
        shutil.copy(source, target)


def engine() -> str | None:
    """Return the docker client where its engine answers."""
    docker = shutil.which("docker")
    if docker is None:
        return None
    asked = subprocess.run([docker, "info"], capture_output=True, env=dict(os.environ), check=False, timeout=60)
    return docker if asked.returncode == 0 else None
