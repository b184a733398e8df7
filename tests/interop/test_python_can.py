"""python-can alone as the other side."""

from __future__ import annotations

import time
from collections.abc import Iterator

import can
import pytest

from tests.interop.buses import Bus, patience
from tests.interop.slave import Slave
from tickrig.host.links.can_link import to_frame, to_message
from tickrig.wire.can import CanFrame

pytestmark = [pytest.mark.realtime, pytest.mark.essential]

PATIENCE_S = patience(10)


@pytest.fixture
def outside(bus: Bus) -> Iterator[can.BusABC]:
    with can.Bus(**bus.keywords) as opened:
        yield opened


def send(outside: can.BusABC, *frames: str) -> None:
    for frame in frames:
        outside.send(to_message(CanFrame.parse(frame)))


def wait_for(outside: can.BusABC, wanted: str) -> None:
    deadline, heard = time.monotonic() + PATIENCE_S, []
    while time.monotonic() < deadline:
        message = outside.recv(0.5)
        frame = to_frame(message) if message else None
        heard.append(str(frame))
        if heard[-1] == wanted:
            return
    raise AssertionError(f"{wanted} did not come, but {heard}")


def test_a_reset_is_answered_by_the_boot_up(outside: can.BusABC, slave: Slave) -> None:
    send(outside, "000#8105")
    wait_for(outside, "705#00")


def test_a_burst_of_requests_is_answered_in_order(outside: can.BusABC, slave: Slave) -> None:
    send(outside, "605#4000200000000000", "605#4001200000000000", "605#4002200000000000")
    for answer in ("585#4F00200000000000", "585#4B01200000000000", "585#4302200000000000"):
        wait_for(outside, answer)


def test_frames_for_nobody_are_passed_over(outside: can.BusABC, slave: Slave) -> None:
    send(outside, "00000605#4000100000000000", "605#R8", "6FF#0102", "605#40001000")
    send(outside, "605#4018100100000000")
    wait_for(outside, "585#4318100101AB0000")
