"""Fixtures of the tests of this folder."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture
def log(tmp_path: Path, request: pytest.FixtureRequest) -> str:
    """Return the path of the log `LOG` of the test module."""
    path = tmp_path / "run.log"
    path.write_text(request.module.LOG, "ascii")
    return str(path)
