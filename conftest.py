"""Options of the whole test run; here, so that `pytest --hil rig.toml` finds them."""

from __future__ import annotations

import signal
from pathlib import Path

import pytest
from hypothesis import HealthCheck, settings

from tests.hil.rrc.rig_file import RIG, BadRigFile, read_rig_file
from tickrig.emulators.testing.plugin import pytest_plugin

collect_ignore = ["tests/stranger"]  # of somebody else: `tests/test_stranger.py` installs it

# How long an example takes says something about the machine, not about the code.
settings.register_profile("tickrig", deadline=None, suppress_health_check=[HealthCheck.too_slow])
settings.load_profile("tickrig")


def pytest_addoption(parser: pytest.Parser, pluginmanager: pytest.PytestPluginManager) -> None:
    if not pluginmanager.has_plugin("tickrig"):  # it is not installed, and runs from src
        pluginmanager.register(pytest_plugin, "tickrig")
    parser.addoption(
        "--hil",
        metavar="RIG.TOML",
        help="run the tests in tests/hil on the real port that this file names",
    )


def pytest_configure(config: pytest.Config) -> None:
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # in the background of a shell
        signal.signal(signal.SIGINT, signal.default_int_handler)  # Ctrl-C works in children
    path = config.getoption("--hil")
    if path is None:
        return
    try:
        config.stash[RIG] = read_rig_file(path)
    except BadRigFile as error:
        raise pytest.UsageError(str(error)) from None


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """With --hil run what tests the hardware, and nothing else."""
    if config.getoption("--hil") is None:
        return
    hil = Path(__file__).parent / "tests" / "hil"
    others = [item for item in items if hil not in item.path.parents]
    config.hook.pytest_deselected(items=others)
    items[:] = [item for item in items if hil in item.path.parents]
