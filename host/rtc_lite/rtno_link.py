"""A device of RTno, as if it spoke RTC-Lite."""

from __future__ import annotations

from tickrig.host.links.link import Link
from tickrig.host.rtc_lite.frame_link import FrameLink
from tickrig.wire.rtc_lite.codes import Command, Status
from tickrig.wire.rtc_lite.frame import Frame
from tickrig.wire.rtc_lite.rtno import LETTERS, RtnoReplies, encode_request


class RtnoLink(FrameLink):
    """Says what RTno has a letter for, and makes up for the rest.

    | asked for | said instead |
    |---|---|
    | PING | `X`, the state; its answer is that to the PING, too |
    | abort | `D`, deactivate: the device is Inactive then, and only its proxy in Error |
    | initialize, finalize, on_startup, on_shutdown, rate, poll | nothing; the reply is `!` |

    Args:
        link: the line.
    """

    def __init__(self, link: Link[bytes]) -> None:
        super().__init__(link, encode_request, RtnoReplies())
        self._ping = b""  # number of the PING that waits for its answer
        self._aborts = False
        self._made_up: list[Frame] = []

    def send(self, frame: Frame) -> None:
        """Send a request, or what stands for it."""
        self._aborts = frame.command is Command.ABORT
        if frame.command is Command.PING:
            self._ping = frame.data
            super().send(Frame(Command.STATE))
        elif self._aborts:
            super().send(Frame(Command.DEACTIVATE))
        elif frame.command in LETTERS:
            super().send(frame)
        else:
            self._made_up.append(Frame(frame.command, bytes([Status.UNSUPPORTED])))

    def receive(self, timeout_us: int) -> list[Frame] | None:
        """Wait for bytes, and return the frames that they complete; None if the line is gone."""
        made_up, self._made_up = self._made_up, []
        frames = super().receive(0 if made_up else timeout_us)
        if frames is None:
            return None
        for frame in frames:
            made_up += self._meant(frame)
        return made_up

    def _meant(self, frame: Frame) -> list[Frame]:
        if frame.command is Command.STATE and self._ping:
            number, self._ping = self._ping, b""
            return [frame, Frame(Command.PING, bytes([Status.OK]) + number)]
        if frame.command is Command.DEACTIVATE and self._aborts:
            return [Frame(Command.ABORT, frame.data)]
        return [frame]
