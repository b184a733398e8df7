"""`dut` of pytest-embedded on a bench: `pytest_plugins = ["tickrig.testing.embedded"]`.

It overrides three fixtures of pytest-embedded, so that its service `serial` opens the port of the
fixture `bench`. The bench is in real time: `dut` reads in a thread of its own.
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
    """Port that `dut` opens: that of the bench."""
    if bench.mode == VIRTUAL:
        raise NotOnThisBench("dut needs real time: --bench-mode real")
    return bench.url


@pytest.fixture(scope="session")
def target(request: pytest.FixtureRequest) -> Any:
    """`--target` of pytest-embedded; with `--lg-env` the target of labgrid.

    labgrid and pytest-embedded both have a fixture of this name. Where both are installed,
    pytest-embedded gets that of labgrid, which skips each test that has no `--lg-env`.
    """
    if request.config.getoption("lg_env", None):
        return request.getfixturevalue("env").get_target()
    return getattr(request, "param", None) or request.config.getoption("target", None)
