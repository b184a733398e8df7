"""A slave of ours on a bus in virtual time, and a host that reads it."""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.canopen.conform.bus.exchange import BusExchange
from tickrig.host.canopen.conform.bus.sdo import SdoClient

NODE_ID = 5


@dataclass
class Bench:
    """A slave, and the host's end of its bus."""

    slave: CanopenSlave
    rig: Rig
    wire: CanWire
    link: CanHost

    @property
    def client(self) -> SdoClient:
        exchange = BusExchange(
            self.link, NODE_ID, bit_rate=1_000_000, max_load=1, permit=lambda frame: None
        )
        return SdoClient(exchange, NODE_ID)

    def upload(self, index: int, sub: int) -> bytes:
        return self.client.upload(index, sub)


def make_bench(dictionary: Dictionary) -> Bench:
    """Put a slave onto a bus and let it boot."""
    slave, wire = make_slave(dictionary, NODE_ID), CanWire()
    rig = Rig(Station(slave, wire.end()))
    bench = Bench(slave, rig, wire, CanHost(rig, wire.end()))
    rig.run_for(10_000)
    return bench
