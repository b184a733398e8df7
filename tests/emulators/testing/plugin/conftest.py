"""Test runs of their own, in this process."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import can
import canopen
import pytest
import serial

from tickrig.emulators.testing.plugin import benched_test, journal_text, pytest_plugin
from tickrig.host.canmon.model.decode import decoder

Run = Callable[..., pytest.RunResult]

SRC = Path(__file__).parents[4] / "src"

IMPORTED_ONCE = (benched_test, journal_text, decoder, can, canopen, serial)
"""A run of its own forgets what it has imported, and what is imported twice has two classes."""


@pytest.fixture(autouse=True)
def _as_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let pytest cut its summary, which it does not on a server for CI."""
    for name in ("CI", "BUILD_NUMBER"):
        monkeypatch.delenv(name, raising=False)


def skip_if_too_slow(result: pytest.RunResult) -> None:
    """Skip a test in real time where the machine could not keep it."""
    if "blocked: the machine was too slow" in result.stdout.str():
        pytest.skip("the machine was too slow")


@pytest.fixture
def run(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run pytest with the plug-in, whether it is installed or not, and with no other one."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("COLUMNS", "250")
    monkeypatch.delenv("PYTEST_ADDOPTS", raising=False)

    def run(*options: str) -> pytest.RunResult:
        given = ("--strict-markers", "-rA", *options)
        return pytester.runpytest_inprocess(*given, plugins=[pytest_plugin])

    return run


@pytest.fixture
def run_apart(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> Run:
    """Run pytest with the plug-in and xdist in a process of its own, and with no other plug-in."""
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")
    monkeypatch.setenv("PYTHONPATH", str(SRC))
    monkeypatch.delenv("PYTEST_ADDOPTS", raising=False)

    def run_apart(*options: str) -> pytest.RunResult:
        plugins = ("-p", pytest_plugin.__name__, "-p", "xdist")
        return pytester.runpytest_subprocess("--strict-markers", "-rA", *plugins, *options)

    return run_apart
