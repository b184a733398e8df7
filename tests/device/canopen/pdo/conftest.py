"""Fixtures of the tests of this folder."""

from __future__ import annotations

import pytest

from tests.device.canopen.pdo_bench import PdoBench


@pytest.fixture
def bench() -> PdoBench:
    return PdoBench()
