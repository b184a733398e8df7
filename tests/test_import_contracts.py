from __future__ import annotations

import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
STALE = shutil.ignore_patterns("__pycache__")

VIOLATIONS = {
    "device reads a clock": ("device/core.py", "import time"),
    "wire does I/O": ("wire/errors.py", "import os"),
    "device knows the host": ("device/core.py", "import tickrig.host.links.link"),
    "host knows the device": ("host/links/link.py", "import tickrig.device.core"),
    "host knows an emulator by its public name": ("host/links/link.py", "from tickrig import Rig"),
    "the door of devices leads to the host": (
        "device/__init__.py",
        "import tickrig.host.links.link",
    ),
    "a rig knows a wire": ("emulators/rig/rig.py", "import tickrig.emulators.can.wire"),
    "one wire knows another": (
        "emulators/serial/serial_line.py",
        "import tickrig.emulators.can.wire",
    ),
    "wire knows an emulator": ("wire/errors.py", "import tickrig.emulators.rig.clock"),
}


def lint(tree: Path) -> subprocess.CompletedProcess[str]:
    program = "import sys; from importlinter.cli import lint_imports_command as c; c()"
    command = [
        sys.executable,
        "-c",
        program,
        "--config",
        str(ROOT / "pyproject.toml"),
        "--no-cache",
    ]
    env = {"PYTHONPATH": str(tree), "PATH": ""}
    return subprocess.run(command, cwd=tree, env=env, capture_output=True, text=True, check=False)


@pytest.fixture(scope="module")
def tree(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Copy the package once; who breaks it mends it."""
    folder = tmp_path_factory.mktemp("tree")
    shutil.copytree(ROOT / "src" / "tickrig", folder / "tickrig", symlinks=False, ignore=STALE)
    return folder


def test_contracts_hold(tree: Path) -> None:
    done = lint(tree)
    assert done.returncode == 0, done.stdout


@pytest.mark.parametrize("name", VIOLATIONS)
def test_a_seeded_violation_breaks_a_contract(name: str, tree: Path) -> None:
    path, line = VIOLATIONS[name]
    module = tree / "tickrig" / path
    source = module.read_text("utf-8")
    module.write_text(f"{source}\n{line}\n")
    done = lint(tree)
    module.write_text(source)
    assert done.returncode != 0
    assert "broken" in done.stdout.lower()
