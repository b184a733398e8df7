"""The boiler room on a bench."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from boiler.kettle import KettleHost
from boiler.master import Master

from tickrig import Bench


@pytest.fixture
def bench_config() -> Path:
    return Path(__file__).parents[1] / "rigs" / "boiler.toml"


@pytest.fixture
def kettle(bench: Bench) -> Iterator[KettleHost]:
    port = bench["kettle"].serial()
    yield KettleHost(port)
    port.close()


@pytest.fixture
def master(bench: Bench, bench_time: object, kettle: KettleHost) -> Iterator[Master]:
    """The master, whose time is that of the bench."""
    bus = bench["stirrer"].can_bus()
    yield Master(bus, on_failure=kettle.stop)
    bus.shutdown()
