"""A wheelchair for each test of the RRC."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.hil.rigs import RIGS
from tests.hil.rrc.chair import Chair
from tickrig import Bench


@pytest.fixture
def bench_config() -> Path:
    return RIGS / "rrc.toml"


@pytest.fixture
def chair(bench: Bench) -> Iterator[Chair]:
    """An RRC that waits for its power button."""
    chair = Chair(bench)
    if bench.mode == "hardware":
        chair.leave()
        chair.client.start()
        if chair.client.stable:
            chair.client.stablemode(on=False)
    yield chair
    if bench.mode == "hardware":
        chair.leave()


@pytest.fixture
def standby(chair: Chair) -> Chair:
    """An RRC in Standby."""
    chair.switch_on()
    return chair


@pytest.fixture(params=["plain", "stable"])
def ready(request: pytest.FixtureRequest, bench_mode: str, standby: Chair) -> Chair:
    """An RRC in Standby, without stablemode (step 4 of the manual's test) and with it (step 5)."""
    if request.param == "stable":
        standby.client.stablemode()
        standby.stable = True
    return standby
