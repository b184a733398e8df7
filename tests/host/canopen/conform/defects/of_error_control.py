"""Defects of heartbeat, guarding and error behaviour."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

from tests.host.canopen.conform.defects.defect import Bends, Defect, Plant, hears, says, tolerant
from tickrig.device.canopen.dictionary import Entry, SdoAbort
from tickrig.device.canopen.errors import ErrorBehaviour
from tickrig.device.canopen.nmt import HeartbeatConsumer, HeartbeatProducer, NodeGuarding
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.nmt import NmtState
from tickrig.wire.canopen.sdo_frame import AbortCode
from tickrig.wire.instant import NEVER


class OffBy(HeartbeatProducer):
    """Sends heartbeats a tenth too late."""

    def schedule(self, due_us: int) -> None:
        if 0 < due_us < NEVER:
            due_us = self.node.now_us + 1_100 * self.node.dictionary[0x1017, 0].number
        super().schedule(due_us)


class Endless(HeartbeatProducer):
    """Goes on with time 0."""

    def schedule(self, due_us: int) -> None:
        super().schedule(self.node.now_us + 100_000 if due_us == NEVER else due_us)


class Sluggish(HeartbeatProducer):
    """Lets the first heartbeat after a change come late."""

    def schedule(self, due_us: int) -> None:
        super().schedule(due_us or self.node.now_us + 150_000)


class Blunt(NodeGuarding):
    """Watches nothing."""

    def tick(self, now_us: int) -> None:
        """Do not notice that the master is gone."""


class Eager(NodeGuarding):
    """Watches before the first request."""

    def schedule(self, due_us: int) -> None:
        life_time_us = self.life_time_us
        early = due_us == NEVER and life_time_us
        super().schedule(self.node.now_us + life_time_us if early else due_us)


class Mindful(NodeGuarding):
    """Keeps its toggle bit over a reset."""

    def start(self) -> None:
        """Keep all."""


class Impatient(HeartbeatConsumer):
    """Watches before the first heartbeat."""

    def reschedule(self) -> None:
        for monitor in self.monitors.values():
            if monitor.deadline_us == NEVER and monitor.nmt_state is None:
                monitor.deadline_us = self.node.now_us + monitor.period_us
        super().reschedule()


class Unmoved(ErrorBehaviour):
    """Stays as it is."""

    def communication_error(self) -> None:
        """Do nothing."""


class Headstrong(ErrorBehaviour):
    """Does not look at 1029h."""

    def tick(self, now_us: int) -> None:
        for entry in self.node.dictionary.elements(0x1029):
            entry.assign(b"\0")
        super().tick(now_us)


def flips_toggle(slave: CanopenSlave) -> Bends:
    def say(text: str) -> Iterable[str]:
        if text.startswith("705#") and text != "705#00":
            return (f"705#{int(text[4:], 16) ^ 0x80:02X}",)
        return (text,)

    return Bends(say=say)


def guards_consumers(*, zero: bool) -> Plant:
    """Refuse time 0, or another time where one is set."""

    def check(entry: Entry, value: Value) -> None:
        if isinstance(value, int) and (entry.number & 0xFFFF if zero else not value & 0xFFFF):
            raise SdoAbort(AbortCode.PARAMETER_INCOMPATIBLE)

    def plant(slave: CanopenSlave) -> Bends:
        for entry in slave.dictionary.elements(0x1016):
            entry.guard = check
        return Bends()

    return plant


def hears_first_only(slave: CanopenSlave) -> Bends:
    """Hear the first heartbeat of others."""
    heard: set[str] = set()

    def hear(text: str) -> Iterable[str]:
        if text.startswith("605#23161001"):
            heard.clear()
        elif text.startswith("7") and text[:3] != "705" and text[:3] in heard:
            return ()
        heard.add(text[:3])
        return (text,)

    return Bends(hear)


def toggles_anew(slave: CanopenSlave) -> Bends:
    def hear(text: str) -> Iterable[str]:
        if text.startswith("000#01"):
            NodeGuarding.of(slave).start()
        return (text,)

    return Bends(hear)


def answers_besides(slave: CanopenSlave) -> Bends:
    """Answer guarding requests beside heartbeats."""

    def hear(text: str) -> Iterable[str]:
        if text.startswith("705#R") and slave.dictionary[0x1017, 0].number:
            slave.send(0x705, bytes([slave.state]))
            slave.due_us = 0
        return (text,)

    return Bends(hear)


def alarm_at_once(slave: CanopenSlave) -> Bends:
    """Report a lost heartbeat that was only configured."""

    def hear(text: str) -> Iterable[str]:
        if text.startswith("605#23161001"):
            slave.emergency(0x8130, 0x10)
        return (text,)

    return Bends(hear)


DEFECTS: Final = (
    Defect("heartbeat off by 10 %", ("HB-01",), services={HeartbeatProducer: OffBy}),
    Defect("no heartbeat", ("HB-01",), says("705#(?!00).*")),
    Defect("heartbeat says another state", ("NMT-03", "HB-01"), says("705#05", "705#7F")),
    Defect("heartbeat never stops", ("HB-03",), services={HeartbeatProducer: Endless}),
    Defect(*("heartbeat begins late", ("HB-04", "HB-02")), services={HeartbeatProducer: Sluggish}),
    Defect(
        "a heartbeat time cannot be read",
        ("HB-06",),
        says("585#43161001(?!0000).*", "585#4316100100000000"),
    ),
    Defect(
        *("two consumers of one node", ("HB-07",)),
        tolerant(AbortCode.PARAMETER_INCOMPATIBLE, "1016:01", "1016:02"),
    ),
    Defect("watches before the first heartbeat", ("HB-09",), alarm_at_once),
    Defect("no EMCY on heartbeat loss", ("HB-10", "NG-05"), says("085#3081.*")),
    Defect("no Pre-operational on heartbeat loss", ("HB-12",), services={ErrorBehaviour: Unmoved}),
    Defect(
        *("1029h is not looked at", ("HB-13", "HB-14")),
        services={ErrorBehaviour: Headstrong},
        needs=frozenset({"1029"}),
    ),
    Defect("error reset missing", ("HB-15", "EM-12"), says("085#0000.*")),
    Defect("guarding toggle stuck", ("NG-01",), says("705#F(.)", r"705#7\1")),
    Defect("guarding begins with toggle 1", ("NG-01",), flips_toggle),
    Defect("no guarding in Stopped", ("NG-04",), hears("705#R.*", only=NmtState.STOPPED)),
    Defect("life guarding missing", ("NG-05",), services={NodeGuarding: Blunt}),
    Defect("life guarding before the first request", ("NG-06",), services={NodeGuarding: Eager}),
    Defect("toggle survives a reset", ("NG-03",), services={NodeGuarding: Mindful}),
    Defect("time 0 is refused for a second node", ("HB-08",), guards_consumers(zero=False)),
    Defect("the time of a node cannot be changed", ("HB-16",), guards_consumers(zero=True)),
    Defect("EMCY though heartbeats come", ("HB-11",), hears_first_only),
    Defect("toggle begins anew with Start", ("NG-02",), toggles_anew),
    Defect("guarding beside heartbeat", ("NG-07",), answers_besides, left=True),
)
