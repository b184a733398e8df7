"""`dut` of pytest-embedded on a bench: `pytest_plugins = ["tickrig.testing.embedded"]`.

This module overrides three fixtures of pytest-embedded, so that the service `serial` of
pytest-embedded opens the port of the fixture `bench`. The bench is in real time: `dut` reads in a
thread of its own.
"""

from __future__ import annotations

from typing import Any

import pytest

from tickrig.emulators.testing.bench.bench import VIRTUAL, Bench
from tickrig.emulators.testing.bench.errors import NotOnThisBench


@pytest.fixture
def embedded_services(request: pytest.FixtureRequest) -> str:
    """Services of the test: `serial`, unless the command line names others."""
    return request.config.getoption("embedded_services", None) or "serial"


@pytest.fixture
def port(bench: Bench) -> str:
    """Port of the bench, which `dut` opens."""
    if bench.mode == VIRTUAL:
        raise NotOnThisBench("dut needs real time: --bench-mode real")
    return bench.url


@pytest.fixture(scope="session")
def target(request: pytest.FixtureRequest) -> Any:
    """Fixture of pytest-embedded: the value of `--target`, or labgrid's target with `--lg-env`.

    labgrid and pytest-embedded both have a fixture with this name. If both are installed,
    pytest-embedded would get the fixture of labgrid, which skips each test without `--lg-env`. This
    fixture replaces both.
    """
    if request.config.getoption("lg_env", None):
        return request.getfixturevalue("env").get_target()
    return getattr(request, "param", None) or request.config.getoption("target", None)
