"""Fixtures of the tests of this folder."""

from __future__ import annotations

import pytest

from tests.device.canopen.motor_core_unit.bench import UnitBench


@pytest.fixture
def bench() -> UnitBench:
    return UnitBench()
