"""A folder with tests of a user, and `tickrig campaign` in it."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

SRC = Path(__file__).parents[4] / "src"

TICKRIG = "from tickrig.commands import tickrig; tickrig()"

HEAD = """
import os
import signal
from pathlib import Path

import pytest

from tickrig.device import Rrc


@pytest.fixture
def bench_config():
    return Rrc()


@pytest.fixture
def flip():
    return 0.001


def once(name):
    try:
        Path(name).touch(exist_ok=False)
    except FileExistsError:
        return False
    return True


def seed_of(request):
    from tickrig.emulators.testing.plugin.settings import SETTINGS

    return request.config.stash[SETTINGS].seed
"""

ANSWERS = """

def test_it_answers(bench, flip):
    bench.fault(f"flip={flip}")
    bench.link.send(b"device\\n")
    bench.run_for("100ms")
    assert "~" not in bench.transcript(), "a bit was flipped"
"""

Campaign = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of its own, in which all commands are typed."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("PYTHONPATH", str(SRC))
    monkeypatch.delenv("PYTEST_ADDOPTS", raising=False)
    (tmp_path / "test_rrc.py").write_text(HEAD + ANSWERS, "utf-8")
    (tmp_path / "pytest.ini").write_text("[pytest]\naddopts = -q -ra\n", "utf-8")
    return tmp_path


@pytest.fixture
def tickrig(folder: Path) -> Campaign:
    """Type `tickrig campaign` with words behind it, and wait for it."""

    def run(*words: str, status: int = 0) -> subprocess.CompletedProcess[str]:
        done = subprocess.run(
            [sys.executable, "-c", TICKRIG, "campaign", *words],
            cwd=folder,
            capture_output=True,
            text=True,
            check=False,
        )
        assert done.returncode == status, done.stdout + done.stderr
        return done

    return run
