"""A slave of ours on a bus in virtual time, and a host that reads it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.slave import CanopenSlave
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig, Station
from tickrig.host.canopen.dialogue import Dialogue, QueuedScript
from tickrig.host.canopen.sdo_transfer import upload
from tickrig.host.links.link import StampedLink
from tickrig.wire.can import data_frame

NODE_ID = 5


@dataclass
class Bench:
    """A slave, and the host's end of its bus."""

    slave: CanopenSlave
    rig: Rig
    wire: CanWire
    link: CanHost

    def upload(self, index: int, sub: int) -> bytes:
        return Reader(self.link, self.slave.node_id).upload(index, sub)


def make_bench(dictionary: Dictionary, node_id: int = NODE_ID) -> Bench:
    """Put a slave onto a bus and let it boot."""
    slave, wire = make_slave(dictionary, node_id), CanWire()
    rig = Rig(Station(slave, wire.end()))
    bench = Bench(slave, rig, wire, CanHost(rig, wire.end()))
    rig.run_for(10_000)
    return bench


class Reader:
    """Reads objects of a node over a link."""

    def __init__(self, link: StampedLink, node_id: int) -> None:
        self._link, self._node_id = link, node_id

    def upload(self, index: int, sub: int) -> bytes:
        ended: list[Any] = []
        link, keep = self._link, ended.append
        talk = Dialogue(self._node_id, lambda can_id, data: link.send((data_frame(can_id, data),)))
        talk.start(link.now_us, QueuedScript("", upload(index, sub), keep, keep))
        while not ended:
            now_us, frames = link.receive_stamped(talk.due_us - link.now_us)
            for _, frame in frames:
                if frame.can_id == 0x580 + self._node_id:
                    talk.receive_sdo(now_us, frame.data)
            talk.tick(now_us)
        if isinstance(ended[0], Exception):
            raise ended[0]
        result: bytes = ended[0]
        return result


Upload = Callable[[int, int], bytes]
