"""Defects of NMT."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from tests.host.canopen.conform.defects.defect import Bends, Defect, Plant, hears, says
from tickrig.device.canopen.nmt import NmtSlave
from tickrig.device.canopen.pdo.rpdo import PdoConsumer
from tickrig.device.canopen.sdo import SdoServers
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import NmtState


class BusyAtStart(NmtSlave):
    """Is Operational after power-on."""

    def booted(self) -> None:
        super().booted()
        self.node.enter(NmtState.OPERATIONAL)


class NoSelfStart(NmtSlave):
    """Does not look at 1F80h."""

    def booted(self) -> None:
        super().booted()
        self.node.enter(NmtState.PRE_OPERATIONAL)


def serves_in_stopped(slave: CanopenSlave) -> Bends:
    def hear(text: str) -> Iterable[str]:
        if slave.state is NmtState.STOPPED and text.startswith("605#"):
            SdoServers.of(slave).default.receive(CanFrame.parse(text))
        return (text,)

    return Bends(hear)


def sends_early(slave: CanopenSlave) -> Bends:
    def hear(text: str) -> Iterable[str]:
        if slave.state is NmtState.PRE_OPERATIONAL and text.startswith("080#"):
            slave.send(0x185, bytes(2))
            slave.due_us = 0
        return (text,)

    return Bends(hear)


def takes_rpdos_early(slave: CanopenSlave) -> Bends:
    def hear(text: str) -> Iterable[str]:
        if slave.state is NmtState.PRE_OPERATIONAL:
            frame = CanFrame.parse(text)
            for rpdo in PdoConsumer.of(slave).rpdos:
                if rpdo.parameters.valid and rpdo.parameters.can_id == frame.can_id:
                    handler = rpdo.listen()
                    if handler is not None:
                        handler(frame)
        return (text,)

    return Bends(hear)


def keeps(*indices: int, command: str) -> Plant:
    """Keep objects over a reset."""

    def plant(slave: CanopenSlave) -> Bends:
        kept: dict[int, bytes] = {}

        def hear(text: str) -> Iterable[str]:
            if text == command:
                kept.update((index, slave.dictionary[index, 0].data) for index in indices)
            return (text,)

        def say(text: str) -> Iterable[str]:
            if text == "705#00":
                for index, data in kept.items():
                    slave.dictionary[index, 0].force(data)
                kept.clear()
            return (text,)

        return Bends(hear, say)

    return plant


DEFECTS: Final = (
    Defect("boot-up missing", ("NMT-01", "NMT-10", "NMT-11"), says("705#00")),
    Defect("boot-up doubled", ("NMT-01", "NMT-11"), says("705#00", "705#00", "705#00")),
    Defect("boot-up with two bytes", ("NMT-01", "NMT-11"), says("705#00", "705#0000")),
    Defect("Operational by itself", ("NMT-02",), services={NmtSlave: BusyAtStart}, left=True),
    Defect("Start is not obeyed", ("NMT-03",), hears("000#01..")),
    Defect("Stop is taken for Pre-operational", ("NMT-04",), hears("000#02(..)", r"000#80\1")),
    Defect("Pre-operational is not obeyed", ("NMT-05",), hears("000#80..")),
    Defect("Start for all nodes is not obeyed", ("NMT-06",), hears("000#..00")),
    Defect(
        "commands for other nodes are obeyed",
        ("NMT-07",),
        hears("000#(..)(?!00|05)..", r"000#\g<1>05"),
    ),
    Defect("unknown command is obeyed", ("NMT-08",), hears("000#(?!0[12]|8[012])..05", "000#0105")),
    Defect("NMT length is not looked at", ("NMT-09",), hears("000#(..05).+", r"000#\1"), left=True),
    Defect("a short command is obeyed", ("NMT-09",), hears("000#(..)", r"000#\g<1>05"), left=True),
    Defect(
        *("reset communication keeps 1017h", ("NMT-10",)),
        keeps(0x1017, command="000#8205"),
    ),
    Defect("reset communication is reset node", ("NMT-10",), hears("000#8205", "000#8105")),
    Defect(
        *("reset node keeps application objects", ("NMT-11",)),
        keeps(0x2000, 0x2001, 0x2002, 0x2003, command="000#8105"),
    ),
    Defect(
        *("reset node is not obeyed in Stopped", ("NMT-12",)),
        hears("000#8105", only=NmtState.STOPPED),
    ),
    Defect("SDO is served in Stopped", ("NMT-13",), serves_in_stopped),
    Defect("TPDO in Pre-operational", ("NMT-14",), sends_early),
    Defect("RPDO is applied in Pre-operational", ("NMT-15",), takes_rpdos_early),
    Defect(
        *("a second Start boots anew", ("NMT-16",)),
        hears("000#0105", "000#8205", "000#0105", only=NmtState.OPERATIONAL),
    ),
    Defect(
        *("Start is not obeyed in Stopped", ("NMT-17",)),
        hears("000#0105", only=NmtState.STOPPED),
    ),
    Defect("remote frames are commands", ("NMT-20",), hears("000#R.*", "000#0105")),
    Defect(
        *("1F80h is not looked at", ("NMT-19",)),
        services={NmtSlave: NoSelfStart},
        needs=frozenset({"1F80"}),
    ),
)
