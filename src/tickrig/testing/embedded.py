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
    """Fixture that replaces the fixtures `target` of pytest-embedded and of labgrid.

    With the option `--lg-env`, the value is labgrid's target. Otherwise the value is that of the
    option `--target` of pytest-embedded.

    labgrid and pytest-embedded both have a fixture with this name. If both are installed,
    pytest-embedded would get the fixture of labgrid, which skips each test without `--lg-env`.
    """
    if request.config.getoption("lg_env", None):
        return request.getfixturevalue("env").get_target()
    return getattr(request, "param", None) or request.config.getoption("target", None)
