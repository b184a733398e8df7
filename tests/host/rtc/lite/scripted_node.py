"""A node at the other end of a link, some of whose answers a test makes up."""

from __future__ import annotations

from collections.abc import Callable

from tests.device.rtc_lite.bench import Recorder
from tickrig.device.rtc_lite.node import TICK_US, RtcLiteNode
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.wire.rtc_lite.codes import LiteCommand
from tickrig.wire.rtc_lite.frame import REQUESTS, LiteDecoder, LiteFrame


class ScriptedNode:
    """A `Link[bytes]` to a node that answers each request in its next tick.

    Attributes:
        node: the device.
        answers: for a request, the frames that come instead of the node's answer, which
            does not hear of it.
        requests: what was asked for.
    """

    def __init__(
        self, make: Callable[[], Recorder] = Recorder, config: LiteConfig | None = None
    ) -> None:
        self.node = RtcLiteNode(make, config or LiteConfig())
        self.answers: dict[LiteCommand, list[LiteFrame]] = {}
        self.requests: list[str] = []
        self.now_us = 0
        self._coming = b""

    @property
    def recorder(self) -> Recorder:
        component = self.node.component
        assert isinstance(component, Recorder)
        return component

    def send(self, traffic: bytes, /) -> None:
        (request,) = LiteDecoder(REQUESTS).push(traffic)
        assert isinstance(request, LiteFrame)
        self.requests.append(request.command.value.decode())
        if (frames := self.answers.get(request.command)) is not None:
            self._coming += b"".join(frame.encode() for frame in frames)
        else:
            self.now_us += TICK_US
            self._coming += self.node.tick(self.now_us, traffic)

    def receive(self, timeout_us: int, /) -> bytes:
        if not self._coming:
            self.now_us += timeout_us
        data, self._coming = self._coming, b""
        return data

    def come(self, *frames: LiteFrame) -> None:
        """Let frames come that nobody asked for."""
        self._coming += b"".join(frame.encode() for frame in frames)

    def taken(self) -> list[str]:
        """Return what was asked for since the last call."""
        requests = self.requests[:]
        self.requests.clear()
        return requests

    def close(self) -> None:
        """Nothing to close."""
