"""The wheel, run by uvx and pipx where nothing of ours is installed."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.environment import make_wheel
from tests.test_containers import wanted

WAYS = {
    "uvx": ("--python", sys.executable, "--from"),
    "pipx": ("run", "--python", sys.executable, "--spec"),
}


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    words = [sys.executable, "-m", "pip", "download", "--quiet", "--no-deps", "click"]
    if subprocess.run(words, cwd=folder, capture_output=True, check=False).returncode:
        pytest.skip("no package index: what the wheel wants cannot be fetched")
    return make_wheel(folder)


@pytest.mark.release
@pytest.mark.parametrize("way", WAYS)
def test_a_demonstration_needs_no_installation(way: str, wheel: Path, tmp_path: Path) -> None:
    """Caches and environments are new, so that all is fetched; a second run finds it there."""
    words = [wanted(way), *WAYS[way], str(wheel), "tickrig", "demo"]
    places = ("UV_CACHE_DIR", "UV_TOOL_DIR", "PIPX_HOME", "PIPX_BIN_DIR", "PIP_CACHE_DIR")
    environment = os.environ | {name: str(tmp_path / name) for name in places}

    def said(*more: str) -> str:
        done = subprocess.run(
            [*words, *more], env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        return done.stdout

    assert said().startswith("tickrig demo rrc ")
    assert said("rrc").splitlines()[-1].startswith("Done. Late ticks: ")
