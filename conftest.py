"""The whole run: the plug-in from the tree, Hypothesis, garbage, Ctrl-C, what coverage measures."""

from __future__ import annotations

import gc
import shutil
import signal
import subprocess
import sys
from collections.abc import Generator
from importlib.util import find_spec

import pytest
from hypothesis import HealthCheck, settings

from tests.soak import examples
from tickrig.emulators.testing.plugin import pytest_plugin

collect_ignore = ["tests/outside", "tests/stranger"]  # of others: tests/test_*.py install them
if find_spec("labgrid") is None:  # an extra that is no part of the development environment
    collect_ignore.append("src/tickrig/testing/labgrid.py")

# How long an example takes says something about the machine, not about the code.
settings.register_profile(
    "tickrig",
    deadline=None,
    max_examples=examples(100),
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("tickrig")


def pytest_addoption(parser: pytest.Parser, pluginmanager: pytest.PytestPluginManager) -> None:
    if not pluginmanager.has_plugin("tickrig"):  # it is not installed, and runs from src
        pluginmanager.register(pytest_plugin, "tickrig")


@pytest.fixture(scope="session")
def user_mode_linux(tmp_path_factory: pytest.TempPathFactory) -> None:
    """Skip where it cannot run at all: tools/with-vcan has to manage all other cases."""
    if not all(map(shutil.which, ("linux.uml", "modprobe", "ip"))):
        pytest.skip("no guest here: it wants the packages user-mode-linux, kmod and iproute2")
    words = ["linux.uml", "mem=64M", "root=/dev/none", "con=null", "con0=null,fd:1"]
    words.append(f"uml_dir={tmp_path_factory.mktemp('uml')}")
    booted = subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True, check=False)
    if b"Unable to mount root" not in booted.stdout:
        pytest.skip("no guest here: linux.uml does not come as far as to look for its files")


def pytest_configure(config: pytest.Config) -> None:
    if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:  # in the background of a shell
        signal.signal(signal.SIGINT, signal.default_int_handler)  # Ctrl-C works in children


@pytest.hookimpl(wrapper=True)
def pytest_collection() -> Generator[None, object, object]:
    """Keep modules and items from the garbage collector: they stay to the end."""
    gc.disable()
    try:
        return (yield)
    finally:
        gc.collect()
        gc.freeze()
        gc.enable()


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Begin with what is in tests/ itself: it takes long, and at the end one worker would do it."""
    items.sort(key=lambda item: item.path.parent.name != "tests")


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, object, object]:
    """Leave out of coverage what is marked so: measured, it takes four times as long."""
    measured = item.config.getoption("cov_source", [])
    if not measured or item.get_closest_marker("unmeasured") is None:
        return (yield)
    tracing = sys.gettrace()
    sys.settrace(None)
    try:
        return (yield)
    finally:
        sys.settrace(tracing)
