"""The services of deploy/compose.yaml as processes: the same commands, health checks and order, on free ports."""

from __future__ import annotations

import re
import subprocess
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

from tests.scale.image import Image
from tests.scale.servers import ROOT, ended, free_port, running, wait_for

FILE = ROOT / "deploy" / "compose.yaml"
SECRET = re.compile(r"\$\{(\w+)(:[?-])([^}]*)\}")


def services(given: dict[str, str]) -> dict[str, dict[str, Any]]:
    """Return the services by name, with values in the place of ``${NAME}``."""

    def filled(found: re.Match[str]) -> str:
        if found[1] in given:
            return given[found[1]]
        assert found[2] == ":-", f"{found[1]} {found[3]}"
        return found[3]

    text = SECRET.sub(filled, FILE.read_text(encoding="utf-8"))
    assert "$" not in text
    found: dict[str, dict[str, Any]] = yaml.safe_load(text)["services"]
    return found


@dataclass
class Place:
    """The services that run; all of them end with the `stack`."""

    image: Image
    services: dict[str, dict[str, Any]]
    stack: ExitStack
    #: Of the test alone, such as how often a worker asks.
    settings: dict[str, str] = field(default_factory=dict)
    #: Free ports by those of the file.
    ports: dict[str, int] = field(default_factory=lambda: {p: free_port() for p in ("4200", "8080", "8786", "9000")})
    #: The output of each service, a file a process.
    logs: dict[str, list[Path]] = field(default_factory=dict)

    def here(self, text: str) -> str:
        """Return a text with this machine's name, ports and folders in it."""
        text = re.sub(rf"//(?:{'|'.join(self.services)}):", "//127.0.0.1:", text).replace("0.0.0.0", "127.0.0.1")  # noqa: S104 - it is taken out
        text = re.sub(rf"\b(?:{'|'.join(self.ports)})\b", lambda found: str(self.ports[found[0]]), text)
        return self.image.here(text)

    def environment(self, name: str) -> dict[str, str]:
        said = {key: self.here(value) for key, value in self.services[name].get("environment", {}).items()}
        return {**self.image.environment(), **self.settings, **said}

    def run(self, name: str, *command: str) -> subprocess.CompletedProcess[str]:
        """Run a command as ``docker compose exec NAME COMMAND`` does, by default that of the service."""
        words = [self.here(word) for word in command or self.services[name]["command"]]
        return subprocess.run(
            words,
            env=self.environment(name),
            cwd=self.image.folder,
            capture_output=True,
            text=True,
            check=False,
            timeout=900,
        )

    def start(self, name: str) -> None:
        """Do a service that ends to its end; start another one as often as it says, and wait until it is healthy."""
        service = self.services[name]
        for other, how in service.get("depends_on", {}).items():
            assert other in self.logs, f"{name} before {other}"
            ends = how["condition"] == "service_completed_successfully"
            assert ends or "healthcheck" in self.services[other], "nothing would say when it is healthy"
            assert ends == self.ends(other), f"{name} waits for what {other} never is"
        self.logs[name] = []
        if self.ends(name):
            done = self.run(name)
            assert done.returncode == 0, (name, done)
            return
        for _ in range(service.get("scale", 1)):
            log = self.image.root / f"{name}-{len(self.logs[name])}.log"
            self.logs[name].append(log)
            command = [self.here(word) for word in service["command"]]
            env, folder = self.environment(name), self.image.folder
            process = self.stack.enter_context(running(command, env, log, cwd=folder))
            if "healthcheck" in service:
                kind, *check = service["healthcheck"]["test"]
                assert kind == "CMD"
                wait_for(lambda: self.run(name, *check).returncode == 0 or ended(process, log), 300.0, every_s=0.5)  # noqa: B023 - asked at once

    def ends(self, name: str) -> bool:
        """Return whether a service does its work once."""
        return bool(self.services[name]["restart"] == "on-failure")
