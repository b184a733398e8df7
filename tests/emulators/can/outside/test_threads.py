"""Hosts with a thread on the bus: refused at once, in a line; else no run would be like another."""

from __future__ import annotations

import logging
import re
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import can
import canopen
import pytest

from tickrig import Bench
from tickrig.device.canopen.models.epos import make_epos
from tickrig.host.links.link import LinkError

TOLD = (
    "bus: a second thread cannot make virtual time pass; take bench.canopen_network() in place of"
    " canopen.Network().connect(), poll in place of a can.Notifier, or run in real time"
)


@pytest.fixture
def bench() -> Iterator[Bench]:
    with Bench(drive=make_epos(5)) as bench:
        yield bench


def test_a_notifier_is_told_and_no_time_passes(
    bench: Bench, caplog: pytest.LogCaptureFixture
) -> None:
    refused, told = threading.Event(), list[Exception]()

    class Listener(can.Listener):
        def on_message_received(self, msg: can.Message) -> None:
            pass

        def on_error(self, exc: Exception) -> None:
            told.append(exc)
            refused.set()

    bus = bench.can_bus()
    with caplog.at_level(logging.ERROR):
        notifier = can.Notifier(bus, [Listener()])
        assert refused.wait(10)
        notifier.stop()
    assert {str(error) for error in told} == {TOLD}
    assert [record.getMessage() for record in caplog.records] == [TOLD]
    assert bench.now_us == 0
    with pytest.raises(can.CanOperationError, match=re.escape(TOLD)):
        bus.recv(0.1)


@pytest.mark.filterwarnings("ignore::pytest.PytestUnhandledThreadExceptionWarning")
def test_a_network_of_the_library_with_a_thread_is_told(bench: Bench) -> None:
    network, before = canopen.Network(), threading.enumerate()
    network.connect(**bench.bus_options)
    for thread in threading.enumerate():
        if thread not in before:
            thread.join(10)
    with pytest.raises(can.CanOperationError, match=re.escape(TOLD)):
        network.check()
    assert bench.now_us == 0
    assert network.bus is not None
    network.bus.shutdown()


@pytest.mark.parametrize("door", ["link", "canopen_network"])
def test_a_second_thread_is_told_and_so_is_the_first(bench: Bench, door: str) -> None:
    used: Callable[[], object]
    if door == "link":
        used = partial(bench.link.receive, 1_000)
    else:
        used = partial(bench.canopen_network().send_message, 0, b"\1\0")
    with ThreadPoolExecutor(1) as pool, pytest.raises(LinkError, match=re.escape(TOLD)):
        pool.submit(used).result(10)
    with pytest.raises(LinkError, match=re.escape(TOLD)):
        used()


def test_a_bus_that_a_second_thread_opens_is_no_way_round(bench: Bench) -> None:
    def host() -> None:
        with can.Bus(**bench.bus_options) as bus:
            bus.recv(0.1)

    bench.bus_options  # noqa: B018 - the name is offered by the thread of the bench
    with ThreadPoolExecutor(1) as pool, pytest.raises(can.CanOperationError, match=re.escape(TOLD)):
        pool.submit(host).result(10)
