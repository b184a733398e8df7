"""Runs the steps of a composite action of GitHub as a runner does, without GitHub.

Of expressions it knows what ours have: `inputs.NAME`, compared with a word or as a value, and
`steps.ID.outputs.NAME` for outputs; anything else is an error.
"""

from __future__ import annotations

import os
import re
import subprocess
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import yaml

BASH = ("bash", "--noprofile", "--norc", "-eo", "pipefail")
"""What a runner takes for `shell: bash`."""


@dataclass
class Runner:
    """A job in which steps of actions run.

    Attributes:
        folder: for the runner's own files.
        environment: what steps find.
        said: what they have printed.
    """

    folder: Path
    environment: dict[str, str] = field(default_factory=lambda: dict(os.environ))
    said: str = ""

    def use(self, action: Path, given: dict[str, str]) -> dict[str, str]:
        """Run an action and return its outputs; CalledProcessError if a step fails."""
        told = yaml.safe_load((action / "action.yml").read_text("utf-8"))
        inputs: dict[str, str] = {
            name: each.get("default", "") for name, each in told["inputs"].items()
        }
        assert given.keys() <= inputs.keys()
        outputs: dict[str, dict[str, str]] = {}
        self.environment["GITHUB_ACTION_PATH"] = str(action)
        for step in told["runs"]["steps"]:
            if _wanted(step.get("if", ""), inputs | given):
                outputs[step.get("id", "")] = self._step(step, inputs | given)
        return {
            name: outputs[match[1]][match[2]]
            for name, each in told.get("outputs", {}).items()
            if (match := re.fullmatch(r"\$\{\{ steps\.(\w+)\.outputs\.(\w+) \}\}", each["value"]))
        }

    def _step(self, step: dict[str, Any], inputs: Mapping[str, str]) -> dict[str, str]:
        """Run a step, and return its outputs."""
        assert step.keys() <= {"name", "id", "if", "shell", "env", "run"}
        assert step["shell"] == "bash"
        given = {name: _value(text, inputs) for name, text in step.get("env", {}).items()}
        self.run(step["run"], given)
        for folder in self._written("GITHUB_PATH"):
            self.environment["PATH"] = f"{folder}:{self.environment['PATH']}"
        return dict(line.split("=", 1) for line in self._written("GITHUB_OUTPUT"))

    def run(self, script: str, given: Mapping[str, str] | None = None) -> str:
        """Run a script as a step does, and return what it says."""
        files = {"RUNNER_TEMP": str(self.folder)}
        files |= {name: str(self.folder / name) for name in ("GITHUB_PATH", "GITHUB_OUTPUT")}
        done: subprocess.CompletedProcess[str] = subprocess.run(
            [*BASH, "-c", script],
            env={**self.environment, **files, **(given or {})},
            capture_output=True,
            text=True,
            check=False,
        )
        self.said += done.stdout + done.stderr
        done.check_returncode()
        return done.stdout

    def _written(self, name: str) -> list[str]:
        """Return what a step has written for the runner, and forget it."""
        if not (file := self.folder / name).exists():
            return []
        lines = file.read_text("utf-8").splitlines()
        file.unlink()
        return lines


def _wanted(condition: str, inputs: Mapping[str, str]) -> bool:
    if not condition:
        return True
    found = re.fullmatch(r"inputs\.(\w+) (==|!=) '(\w*)'", condition)
    assert found, condition
    return (inputs[found[1]] == found[3]) == (found[2] == "==")


def _value(text: str, inputs: Mapping[str, str]) -> str:
    found = re.fullmatch(r"\$\{\{ inputs\.(\w+) \}\}", text)
    assert found, text
    return inputs[found[1]]
