from __future__ import annotations

from tests.device.canopen.slave_bench import frames
from tickrig.emulators.can.outside.bridge import WithoutEcho
from tickrig.host.links.echo import ECHO_US
from tickrig.wire.can import Frames
from tickrig.wire.instant import NEVER


class Loop:
    """A bus that gives back what it takes, beside what others send."""

    lost, due_us = 3, NEVER

    def __init__(self) -> None:
        self.waiting: Frames = ()

    def poll(self, now_us: int, /) -> Frames:
        taken, self.waiting = self.waiting, ()
        return taken

    def send(self, now_us: int, traffic: Frames, /) -> None:
        self.waiting += traffic


def test_what_was_sent_does_not_come_back() -> None:
    loop = Loop()
    port = WithoutEcho(loop)
    port.send(0, frames("705#00", "705#7F"))
    loop.send(0, frames("000#0105"))
    assert port.poll(1_000) == frames("000#0105")
    assert (port.lost, port.due_us) == (3, NEVER)


def test_the_same_frame_from_somebody_else_is_heard_once() -> None:
    loop = Loop()
    port = WithoutEcho(loop)
    port.send(0, frames("080#"))
    loop.send(0, frames("080#"))
    assert port.poll(1_000) == frames("080#")


def test_an_echo_that_was_lost_is_not_awaited_for_ever() -> None:
    loop = Loop()
    port = WithoutEcho(loop)
    port.send(0, frames("080#"))
    loop.waiting = ()
    assert port.poll(ECHO_US + 1) == ()
    loop.send(ECHO_US + 1, frames("080#"))
    assert port.poll(ECHO_US + 2) == frames("080#")
