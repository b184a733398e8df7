"""A node on the bench, and a component that fails as told and notes what is called."""

from __future__ import annotations

from collections.abc import Callable

from tests.wire.rtc_lite.vectors import raw
from tickrig.device.component import ERROR, Result
from tickrig.device.rtc_lite.component import LiteComponent, LiteInPort, LiteOutPort
from tickrig.device.rtc_lite.node import TICK_US, RtcLiteNode
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.wire.rtc_lite.codes import LiteCommand
from tickrig.wire.rtc_lite.frame import REPLIES, LiteDecoder, LiteFrame
from tickrig.wire.rtc_lite.values import LONG


class Recorder(LiteComponent):
    """An echo with all callbacks.

    Attributes:
        failing: names of the callbacks that return an error.
        called: names of those that ran.
    """

    type_name = "Echo0"
    inlet = LiteInPort("in", LONG)
    outlet = LiteOutPort("out", LONG)

    def __init__(self) -> None:
        super().__init__()
        self.failing: set[str] = set()
        self.called: list[str] = []

    def _note(self, name: str) -> Result:
        self.called.append(name)
        return ERROR if name in self.failing else None

    def on_initialize(self) -> Result:
        return self._note("on_initialize")

    def on_finalize(self) -> Result:
        return self._note("on_finalize")

    def on_startup(self) -> Result:
        return self._note("on_startup")

    def on_shutdown(self) -> Result:
        return self._note("on_shutdown")

    def on_activated(self) -> Result:
        return self._note("on_activated")

    def on_deactivated(self) -> Result:
        return self._note("on_deactivated")

    def on_execute(self) -> Result:
        result = self._note("on_execute")
        if result is None and self.inlet.is_new:
            self.outlet.write(self.inlet.read())
        return result

    def on_aborting(self) -> Result:
        return self._note("on_aborting")

    def on_error(self) -> Result:
        return self._note("on_error")

    def on_reset(self) -> Result:
        return self._note("on_reset")


class NodeBench:
    """A node whose ticks are stepped one by one.

    Attributes:
        node: the device.
        now_us: time of the latest tick.
    """

    def __init__(
        self, make: Callable[[], LiteComponent] = Recorder, config: LiteConfig | None = None
    ) -> None:
        self.node = RtcLiteNode(make, config or LiteConfig())
        self.now_us = 0

    @property
    def recorder(self) -> Recorder:
        component = self.node.component
        assert isinstance(component, Recorder)
        return component

    @property
    def state(self) -> str:
        return str(self.node.read("state"))

    def push(self, data: bytes = b"") -> bytes:
        """Run one tick."""
        self.now_us += TICK_US
        return self.node.tick(self.now_us, data)

    def say(self, *frames: str) -> str:
        """Run one tick with frames in hex, and return the answer in hex."""
        return self.push(raw(*frames)).hex(" ").upper()

    def ask(self, request: str) -> str:
        """Run one tick with a request written without header and checksum, as `AE`.

        The answer is written in the same way, frames with a space between them.
        """
        data = request.encode("latin-1")
        found = LiteDecoder(REPLIES).push(
            self.push(LiteFrame(LiteCommand(data[:2]), data[2:]).encode())
        )
        return " ".join(
            frame.body.decode("latin-1") for frame in found if isinstance(frame, LiteFrame)
        )

    def run(self, duration_us: int) -> bytes:
        """Run ticks without input."""
        return b"".join(self.push() for _ in range(duration_us // TICK_US))

    def enter(self, state: str) -> NodeBench:
        """Go to a state from power-up on, and forget what was called on the way."""
        path = {
            "Created": "CX",
            "Inactive": "CI",
            "Active": "CI AA",
            "Error": "CI AA AB",
            "None": "CI CF",
        }
        for request in path[state].split():
            self.ask(request)
        assert self.state == state
        self.recorder.called.clear()
        return self
