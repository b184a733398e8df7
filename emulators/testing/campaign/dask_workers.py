"""Workers of a Dask cluster (extra `campaign`): each of its threads has a process for runs."""

from __future__ import annotations

import asyncio
import logging
import re
from collections.abc import Sequence
from concurrent.futures import CancelledError, Future
from contextlib import suppress
from functools import partial
from threading import Thread
from typing import Any, Final
from uuid import uuid4

from distributed import Client, KilledWorker, Worker, WorkerPlugin, get_worker
from distributed.core import rpc

from tickrig._version import __version__
from tickrig.emulators.testing.campaign.crew import Crew
from tickrig.emulators.testing.campaign.order import (
    CampaignOrder,
    CampaignRefusal,
    Run,
    RunVerdict,
    verdicts_of,
)
from tickrig.emulators.testing.campaign.plan import CampaignPlan
from tickrig.host.text.page_text import one_line

_CONNECT_S: Final = 10.0
_SCHEDULER: Final = "Scheduler"
"""Type name of a scheduler; a worker has `Worker`."""

_WAIT_S: Final = 60.0
"""Longest time that a scheduler may be without workers."""

_CLOSE_S: Final = 5.0
"""Time-out for removing a campaign from the cluster."""

_GONE: Final = (OSError, RuntimeError, TimeoutError, CancelledError)

_LOSSES: Final = 3
"""Number of retries of a batch that Dask has lost."""


class _CrewPlugin(WorkerPlugin):
    """Gives each worker of a cluster a crew while a campaign runs.

    Args:
        order: the tests that the crew collects.
    """

    crew: Crew

    def __init__(self, order: CampaignOrder) -> None:
        self._order = order
        self.name = f"tickrig-campaign-{uuid4().hex}"

    def setup(self, worker: Worker) -> None:
        """Start a crew; the first runs start its processes."""
        self.crew = Crew(self._order)

    def teardown(self, worker: Worker) -> None:
        """End all processes."""
        self.crew.close()


class DaskWorkers:
    """Runs the tests of a campaign on all threads of a Dask cluster.

    If a worker is lost, another worker repeats its runs.

    Args:
        url: address of the Dask scheduler.
        plan: plan of the campaign.

    Raises:
        Refusal: there is no scheduler, or no worker.
    """

    def __init__(self, url: str, plan: CampaignPlan) -> None:
        be_quiet()
        self._url, self._plan, self._plugin = url, plan, _CrewPlugin(plan.order)
        if re.fullmatch(r"\w+://.+:[0-9]+", url) is None:
            raise CampaignRefusal(f"--scheduler {url}: write tcp://HOST:PORT")
        try:
            asyncio.run(asyncio.wait_for(_ask_for_scheduler(url), _CONNECT_S))
            self._client = Client(url, timeout=_CONNECT_S, set_as_default=False)
        except TimeoutError:
            raise CampaignRefusal(f"--scheduler {url}: no answer within {_CONNECT_S:g} s") from None
        except Exception as error:  # Dask raises anything when something else listens there
            text = one_line(str(error).partition("\n")[0]) or type(error).__name__
            raise CampaignRefusal(f"--scheduler {url}: no Dask scheduler: {text}") from None
        try:
            self._client.wait_for_workers(1, _WAIT_S)
            self._client.register_plugin(self._plugin)
        except TimeoutError:
            self._client.close()
            raise CampaignRefusal(
                f"--scheduler {url}: it has no worker: dask worker {url}"
            ) from None
        self._executor = self._client.get_executor(pure=False)

    @property
    def count(self) -> int:
        """Number of threads of the present workers."""
        try:
            threads: dict[str, int] = self._client.nthreads()
            return max(1, sum(threads.values()))
        except (OSError, RuntimeError, TimeoutError):
            raise self._gone() from None

    def submit(self, runs: Sequence[Run]) -> Future[list[RunVerdict]]:
        """Submit runs to a worker of the cluster."""
        wanted: Future[list[RunVerdict]] = Future()
        self._try(list(runs), wanted, _LOSSES)
        return wanted

    def _try(self, runs: list[Run], wanted: Future[list[RunVerdict]], losses: int) -> None:
        digest, version = self._plan.collected.digest, self._plan.order.version
        future = self._executor.submit(_do, self._plugin.name, runs, digest, version)
        future.add_done_callback(partial(self._take, runs, wanted, losses))

    def _take(
        self, runs: list[Run], wanted: Future[list[RunVerdict]], losses: int, future: Future[Any]
    ) -> None:
        """Forward the result of runs."""
        error = CancelledError() if future.cancelled() else future.exception()
        if isinstance(error, KilledWorker) and losses:
            self._try(runs, wanted, losses - 1)
        elif isinstance(error, CancelledError):
            wanted.set_exception(self._gone())
        elif error is not None:
            text = f"{type(error).__name__}: {error}".partition("\n")[0]
            wanted.set_exception(CampaignRefusal(f"--scheduler {self._url}: {text}"))
        elif isinstance(answer := future.result(), str):
            wanted.set_exception(CampaignRefusal(one_line(answer)))
        else:
            try:
                wanted.set_result(verdicts_of(answer, runs))
            except ValueError as mistake:
                wanted.set_exception(
                    CampaignRefusal(f"--scheduler {self._url}: a worker sent {mistake}")
                )

    def _gone(self) -> CampaignRefusal:
        return CampaignRefusal(f"--scheduler {self._url} is gone; what was done is kept")

    def close(self) -> None:
        """Remove the campaign from the cluster, if the cluster still answers."""
        with suppress(*_GONE):
            self._executor.shutdown(wait=False)
        forgetting = Thread(target=self._forget, daemon=True)
        forgetting.start()
        forgetting.join(_CLOSE_S)
        with suppress(*_GONE):
            self._client.close(timeout=1)

    def _forget(self) -> None:
        """Remove the plug-in; without a scheduler or worker, Dask waits here without a limit."""
        with suppress(*_GONE):
            self._client.unregister_worker_plugin(self._plugin.name)


async def _ask_for_scheduler(url: str) -> None:
    """Raise unless a scheduler answers; a `Client` would wait for the answer without a limit."""
    async with rpc(url, timeout=_CONNECT_S) as scheduler:
        answer = await scheduler.identity()
    if not isinstance(answer, dict) or answer.get("type") != _SCHEDULER:
        raise ValueError(f"{one_line(repr(answer))[:60]} answers there")


def be_quiet() -> None:
    """Silence the tracebacks that Dask and Tornado log for lost workers."""
    for name in ("distributed", "distributed.client", "tornado", "tornado.application", "asyncio"):
        logging.getLogger(name).handlers[:] = [logging.NullHandler()]


def _do(name: str, runs: Sequence[Run], digest: str, version: str) -> list[RunVerdict] | str:
    """Do runs on this worker; return the verdicts, or a text if the worker refuses."""
    worker = get_worker()
    if __version__ != version:
        return f"{worker.address}: there is tickrig {__version__}, here {version}"
    try:
        plugin = worker.plugins[name]
        assert isinstance(plugin, _CrewPlugin)
        return plugin.crew.do([Run(*run) for run in runs], digest)
    except CampaignRefusal as refusal:
        return f"{worker.address}: {refusal}"
