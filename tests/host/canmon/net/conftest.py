"""Fixtures of the tests of this folder."""

from __future__ import annotations

from pathlib import Path

import pytest


@pytest.fixture
def rig(tmp_path: Path, request: pytest.FixtureRequest) -> str:
    """Return the path of the rig file `RIG` of the test module."""
    path = tmp_path / "bench.toml"
    path.write_text(request.module.RIG)
    return str(path)
