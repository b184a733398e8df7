"""A session of the monitor on our EPOS-like drive as node 5, in virtual time."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tickrig.device.canopen.models import epos
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.canmon.model.decode.node_memory import read_eds_objects
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.sources.source import AnySource
from tickrig.host.canmon.tui.session import Model, Session
from tickrig.wire.can import CanFrame, FdFrame

EPOS = Path(__file__).parents[4] / "examples/eds/epos.eds"
NODE = 5
BUS = "can0"


class RigSource(AnySource[Record]):
    """The rig's wire as a source; its time passes while it is polled."""

    live = True

    def __init__(self, host: CanHost) -> None:
        self._host = host

    def poll(self, timeout_us: int, /) -> list[Record]:
        frames: Sequence[CanFrame] = self._host.receive(max(1, timeout_us))
        return [Record(self._host.now_us, BUS, frame) for frame in frames]


class RigSession(Session):
    """A session that is stepped by hand.

    Attributes:
        drive: the drive on the wire.
        frames: what was sent, in candump text.
    """

    def __init__(self, *, eds: bool = True, bit_rate: int | None = None) -> None:
        wire = CanWire()
        slave = epos.make_epos(NODE)
        self.drive = epos.Epos.of(slave)
        self._host = host = CanHost(Rig(Station(slave, wire.end())), wire.end())
        self.frames: list[str] = []
        described = {NODE: read_eds_objects(EPOS, NODE)} if eds else {}
        model = Model(described, bit_rate=bit_rate)
        super().__init__(RigSource(host), model, {BUS: self._put}, lambda: host.now_us)

    def _put(self, frame: CanFrame | FdFrame) -> None:
        self.frames.append(str(frame))
        assert isinstance(frame, CanFrame), "a rig has classic CAN"
        self._host.send((frame,))

    def run(self, span_us: int) -> None:
        """Let time pass."""
        end_us = self.now_us + span_us
        while self.now_us < end_us:
            self.step(end_us - self.now_us)
