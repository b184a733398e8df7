"""A link on a bus that echoes."""

from __future__ import annotations

from tests.emulators.can.can_bench import frames
from tickrig.host.links.echo import EchoFreeLink
from tickrig.host.links.link import StampedFrames
from tickrig.wire.can import Frames


class EchoingLink:
    """Gives back what was sent, behind what others sent."""

    def __init__(self) -> None:
        self.now_us = 0
        self.frames: Frames = ()
        self.closed = False

    def send(self, traffic: Frames, /) -> None:
        self.frames += traffic

    def receive(self, timeout_us: int, /) -> Frames:
        return tuple(frame for _, frame in self.receive_stamped(timeout_us)[1])

    def receive_stamped(self, timeout_us: int, /) -> tuple[int, StampedFrames]:
        received, self.frames = self.frames, ()
        return self.now_us, tuple((self.now_us, frame) for frame in received)

    def close(self) -> None:
        self.closed = True


def test_what_others_send_is_heard_and_what_was_sent_is_not() -> None:
    link = EchoFreeLink(behind := EchoingLink())
    link.send(frames("000#0110 080#"))
    behind.send(frames("710#7F 080#"))
    assert link.receive(0) == frames("710#7F 080#")


def test_an_echo_that_does_not_come_is_no_longer_awaited_after_a_second() -> None:
    link = EchoFreeLink(behind := EchoingLink())
    link.send(frames("080#"))
    behind.frames = ()
    link.receive(0)
    behind.now_us = 1_000_001
    behind.send(frames("080#"))
    assert link.receive(0) == frames("080#")
    link.close()
    assert behind.closed
