"""NMT slave of a DeviceRTC (NEDO report, 3.4.43.3, Figs. 110 and 111)."""

from __future__ import annotations

from collections.abc import Iterator

from tickrig.device.canopen.device_rtc.device import DeviceRtc
from tickrig.device.canopen.device_rtc.life_cycle import LifeCycle
from tickrig.device.canopen.nmt_slave import NmtSlave
from tickrig.device.canopen.service import Handler
from tickrig.wire.canopen.nmt import NMT_COB_ID, NmtCommand, NmtState


class RtcNmt(NmtSlave):
    """Asks the life cycle of the component before it boots and obeys.

    It listens while Initialising, too: Reset Node is a new try for a component whose
    `on_initialize` has failed (DECISION K11).
    """

    def booted(self) -> None:
        """Boot, unless the component stays in Created or has ended."""
        if self._life.boots():
            super().booted()

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        """Listen to the NMT master."""
        yield NMT_COB_ID, self._receive

    def obey(self, command: NmtCommand) -> None:
        """Carry out a command, if the state of the component lets it through."""
        if self._life.admits(command):
            super().obey(command)

    @property
    def _life(self) -> LifeCycle:
        return DeviceRtc.of(self.node).life
