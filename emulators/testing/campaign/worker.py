"""A worker: pytest in its own process, which runs collected tests on request.

    python -m tickrig.emulators.testing.campaign.worker CONNECTION ALIVE

CONNECTION is the file descriptor of the pipe to the parent. ALIVE is the file descriptor of a pipe
that closes when the parent ends.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import sys
import threading
from collections.abc import Callable
from hashlib import sha256
from importlib.metadata import entry_points
from multiprocessing.connection import Connection
from os.path import relpath
from pathlib import Path
from typing import Final

import pytest

from tickrig.emulators.testing.campaign.order import (
    CampaignOrder,
    Collected,
    CollectedTest,
    Run,
    RunVerdict,
)
from tickrig.emulators.testing.plugin import pytest_plugin
from tickrig.emulators.testing.plugin.bench_source import SNAPSHOTS
from tickrig.emulators.testing.plugin.failure_report import outcome_of
from tickrig.emulators.testing.plugin.parameters import words_of
from tickrig.emulators.testing.plugin.settings import SETTINGS
from tickrig.emulators.testing.plugin.stash import BENCHED
from tickrig.emulators.testing.report.bench_report import Outcome

_IDLE_S: Final = 60.0
"""Idle time after which a worker ends; another worker is started when needed."""

_MOST: Final = 300
"""Largest number of characters of a reason."""

_REPORTER: Final = "terminalreporter"
"""The name of the plug-in that writes to the terminal."""

_ADDRESS: Final = re.compile(r"\b0x[0-9a-f]{8,16}\b")


class _Worker:
    """The plug-in that replaces pytest's loop over all tests.

    Args:
        conn: the pipe to the parent.
        order: order of the campaign, with the tests to collect.
    """

    def __init__(self, conn: Connection, order: CampaignOrder) -> None:
        self._conn, self._order = conn, order
        self._reports: list[pytest.TestReport] = []
        self.refusal = ""
        self.ready = False

    @pytest.hookimpl(trylast=True)
    def pytest_configure(self, config: pytest.Config) -> None:
        """Replace pytest's terminal reporter in a worker process by one that prints nothing.

        There must be a reporter, because pytest up to 9.0 needs it to explain what `assert`
        compared.
        """
        config.pluginmanager.unregister(name=_REPORTER)
        self._silent = pytest.TerminalReporter(config, open(os.devnull, "w"))  # noqa: SIM115
        config.pluginmanager.register(self._silent, _REPORTER)

    def pytest_collectreport(self, report: pytest.CollectReport) -> None:
        """Record the first file that cannot be collected."""
        if report.failed and not self.refusal:
            crash = getattr(report.longrepr, "reprcrash", None)
            text = crash.message if crash else report.longreprtext
            lines = [line for line in text.splitlines() if line.strip()] or ["it cannot be read"]
            line = lines[0] if crash else lines[-1].removeprefix("E").strip()
            self.refusal = f"{report.nodeid}: {line}"

    @pytest.hookimpl(tryfirst=True)
    def pytest_runtestloop(self, session: pytest.Session) -> bool:
        """Run requested tests until there are no more requests."""
        if session.testsfailed:
            return True
        session.config.stash[SNAPSHOTS] = {}
        items = {item.nodeid: item for item in session.items}
        self._conn.send(collected(session))
        self.ready, sys.stderr = True, open(os.devnull, "w")  # noqa: SIM115 - to the end
        with contextlib.suppress(EOFError):
            while self._conn.poll(_IDLE_S):
                for run in self._conn.recv():
                    self._conn.send(self._run(items[run.nodeid], run))
        return True

    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        """Record the result of a phase of the test."""
        self._reports.append(report)

    def _run(self, item: pytest.Item, run: Run) -> RunVerdict:
        """Run a test as if it were alone; session fixtures are kept."""
        settings = item.config.stash[SETTINGS]
        item.config.stash[SETTINGS] = settings._replace(seed=run.seed)
        del item.user_properties[:], item._report_sections[:], self._reports[:]
        self._silent.stats.clear()  # it keeps each report
        if BENCHED in item.stash:
            del item.stash[BENCHED]
        protocol: Callable[..., object] = item.config.hook.pytest_runtest_protocol
        try:
            protocol(item=item, nextitem=item.session)
        except pytest.exit.Exception as error:
            item.session._setupstate.teardown_exact(None)
            item._request = False  # type: ignore[attr-defined] # its fixtures are made again
            return RunVerdict(run.number, Outcome.ERROR.value, reason=_one_line(f"exit: {error}"))
        outcome, reason, _ = outcome_of(item, self._reports)
        where = "" if outcome is Outcome.PASSED else _where(item, self._reports)
        test = item.stash.get(BENCHED, None)
        now_us = test.bench.now_us if test is not None and test.bench is not None else 0
        return RunVerdict(run.number, outcome.value, now_us, where, _one_line(reason))


def _where(item: pytest.Item, reports: list[pytest.TestReport]) -> str:
    """Return file and line of the first failure, the same on each machine."""
    failed = (report.longrepr for report in reports if report.failed)
    crash = getattr(next(failed, None), "reprcrash", None)
    if crash is None:
        return ""
    file, root = Path(crash.path).absolute(), item.config.rootpath
    shown = file.relative_to(root).as_posix() if file.is_relative_to(root) else file.name
    return f"{shown}:{crash.lineno}"


def _one_line(reason: str) -> str:
    """Return a reason without addresses and line ends, so that it is the same in each process.

    >>> _one_line("<Lamp object at 0x7f3d9cdb2d10> is dark")
    '<Lamp object at 0x...> is dark'
    """
    text = " ".join(_ADDRESS.sub("0x...", reason).split())
    return text if len(text) <= _MOST else f"{text[: _MOST - 3]}..."


def collected(session: pytest.Session) -> Collected:
    """Return the tests that have a bench."""
    config = session.config
    benched = [item for item in session.items if "bench" in getattr(item, "fixturenames", ())]
    tests = [CollectedTest(str(i.nodeid), dict(words_of(i)), _place(config, i)) for i in benched]
    without = [str(item.nodeid) for item in session.items if item not in benched]
    return Collected(tuple(tests), tuple(without), _digest(config, benched))


def _place(config: pytest.Config, item: pytest.Item) -> str:
    """Return a node ID relative to the folder of the campaign."""
    file, *names = str(item.nodeid).split("::")
    return "::".join([relpath(config.rootpath / file, config.invocation_params.dir), *names])


def _digest(config: pytest.Config, items: list[pytest.Item]) -> str:
    """Return the hash of the test files, their imports in the project, and the rig file."""
    files = {item.path for item in items}
    for module in [*sys.modules.values()]:
        file = Path(getattr(module, "__file__", None) or "/")
        if file.is_relative_to(config.rootpath) and "site-packages" not in file.parts:
            files.add(file)
    settings = config.stash[SETTINGS]
    if settings.rig_file:
        files.add(settings.rig_file.absolute())
    digest = sha256()
    for name, file in sorted((relpath(file, config.rootpath), file) for file in files):
        digest.update(f"{name} {sha256(file.read_bytes()).hexdigest()}\n".encode())
    return digest.hexdigest()[:16]


def main(conn: Connection, alive: int) -> None:
    """Serve requests from a pipe."""
    threading.Thread(target=_end_with, args=(alive,), daemon=True).start()
    order: CampaignOrder = conn.recv()
    worker, said = _Worker(conn, order), io.StringIO()
    plugins: list[object] = [worker]
    if not any(point.name == "tickrig" for point in entry_points(group="pytest11")) or (
        os.environ.get("PYTEST_DISABLE_PLUGIN_AUTOLOAD")
    ):
        plugins.append(pytest_plugin)
    with contextlib.redirect_stderr(said):
        pytest.main(order.words(), plugins)
    if not worker.ready:
        conn.send(worker.refusal or _last_line(said.getvalue()))


def _last_line(said: str) -> str:
    """Return the error line with which pytest ended."""
    lines = [line.removeprefix("ERROR: ").strip() for line in said.splitlines() if line.strip()]
    errors = [line for line in lines if "error:" in line]
    return (errors or lines or ["no tests were collected"])[0]


def _end_with(alive: int) -> None:
    """Exit when the parent has ended, even in the middle of a stuck test."""
    os.read(alive, 1)
    os._exit(1)


if __name__ == "__main__":
    main(Connection(int(sys.argv[1])), int(sys.argv[2]))
