"""Defects made from the text alone, by somebody who had not read the checks."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from operator import eq, gt, lt
from typing import Any, ClassVar, Final

from tests.host.canopen.conform.defects.defect import Bends, Defect, Plant, hears, says
from tickrig.device.canopen.bus.lss_slave import LssSlave, MessageSequence
from tickrig.device.canopen.bus.parameter_store import ParameterStore
from tickrig.device.canopen.bus.sync import Sync
from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.core.service import Handler
from tickrig.device.canopen.core.slave import UNCONFIGURED, CanopenSlave
from tickrig.device.canopen.errors.emcy_producer import EmcyProducer
from tickrig.device.canopen.errors.error_behaviour import ErrorBehaviour
from tickrig.device.canopen.nmt.error_control import HeartbeatProducer, NodeGuarding
from tickrig.device.canopen.nmt.heartbeat_consumer import HeartbeatConsumer, Monitor
from tickrig.device.canopen.nmt.nmt_slave import NmtSlave
from tickrig.device.canopen.pdo.pdo_consumer import PdoConsumer
from tickrig.device.canopen.pdo.pdo_packing import Pack, total_bits
from tickrig.device.canopen.pdo.pdo_producer import PdoProducer
from tickrig.device.canopen.pdo.tpdo import Tpdo
from tickrig.device.canopen.pdo.tpdo_modes import (
    EventDriven,
    PdoSender,
    SynchronousAcyclic,
    SynchronousCyclic,
    TpdoMode,
)
from tickrig.device.canopen.sdo.sdo_segmented import SegmentedDownload
from tickrig.device.canopen.sdo.sdo_servers import SdoServers
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister
from tickrig.wire.canopen.nmt import ERROR_CONTROL_COB_ID, NmtState
from tickrig.wire.instant import NEVER

TOGGLE: Final = 0x10
REQUEST: Final = "605#"
RESPONSE: Final = "585#"


def _byte(text: str, place: int) -> int:
    """Return a byte of a data frame, -1 if it has not so many."""
    digits = text[4 + 2 * place : 6 + 2 * place]
    return int(digits, 16) if digits and text[3] == "#" and "R" not in text else -1


def _with_byte(text: str, place: int, byte: int) -> str:
    return f"{text[: 4 + 2 * place]}{byte:02X}{text[6 + 2 * place :]}"


# NMT


class BootsFromStopped(NmtSlave):
    """Sends the boot-up message whenever it enters Pre-operational from Stopped."""

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        if old is NmtState.STOPPED and new is NmtState.PRE_OPERATIONAL:
            self.node.send(ERROR_CONTROL_COB_ID + self.node.node_id, b"\0")


# Heartbeat and guarding


class PeriodKept(HeartbeatProducer):
    """Keeps the period with which it began until 0 is written, or a reset."""

    _kept_us = 0

    def booted(self) -> None:
        self._kept_us = 0
        super().booted()

    def tick(self, now_us: int) -> None:
        written_us = 1_000 * self._period.number if self._period is not None else 0
        self._kept_us = written_us and (self._kept_us or written_us)
        super().tick(now_us)
        if written_us:
            self._due_us += self._kept_us - written_us
            self.schedule(self._due_us)


def tells_old_state(slave: CanopenSlave) -> Bends:
    """Tell in each heartbeat the state that was due in the one before."""
    told = ["7F"]

    def say(text: str) -> Iterable[str]:
        if text == "705#00":
            told[0] = "7F"
        elif text.startswith("705#") and slave.dictionary[0x1017, 0].number:
            before, told[0] = told[0], text[4:]
            return (f"705#{before}",)
        return (text,)

    return Bends(say=say)


class ShortTimes(HeartbeatConsumer):
    """Keeps consumer heartbeat times in one byte."""

    def _watch(self, entry: Entry) -> None:
        super()._watch(entry)
        if entry.sub in self.monitors:
            self.monitors[entry.sub] = Monitor(self, entry.number & 0xFF_00FF)


class StoppedIsLost(HeartbeatConsumer):
    """Takes no heartbeat of a node that is Stopped."""

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        for can_id, receive in super().handlers(state):
            yield can_id, _unless_stopped(receive)


def _unless_stopped(receive: Handler) -> Handler:
    def handler(frame: CanFrame) -> None:
        if frame.data != b"\x04":
            receive(frame)

    return handler


class NeverEnds(HeartbeatConsumer):
    """Goes on monitoring where time 0 is written."""

    def _changed(self, entry: Entry) -> None:
        if entry.number & 0xFFFF:
            super()._changed(entry)


class ToggleKept(NodeGuarding):
    """Goes on with the toggle bit after a reset."""

    def power_on(self) -> None:
        self._toggle = 0

    def start(self) -> None:
        """Keep the toggle bit."""


class NoFactor(NodeGuarding):
    """Takes the guard time for the node life time."""

    @property
    def life_time_us(self) -> int:
        factor = super().life_time_us
        return self._guard_time.number * 1_000 if factor and self._guard_time else 0


class GuardsWithoutAct(NodeGuarding):
    """Reports a life guarding event and stays Operational."""

    def tick(self, now_us: int) -> None:
        self.node.emergency(EmcyCode.HEARTBEAT, ErrorRegister.COMMUNICATION)


# SDO


def abort_names_the_one_before(slave: CanopenSlave) -> Bends:
    """Name in an abort the object of the transfer before."""
    named = ["000000", "000000"]

    def hear(text: str) -> Iterable[str]:
        if re.match("605#(2|4|A[04]|C[0246])", text):
            named[:] = named[1], text[6:12]
        return (text,)

    def say(text: str) -> Iterable[str]:
        return (f"{text[:6]}{named[0]}{text[12:]}" if text.startswith("585#80") else text,)

    return Bends(hear, say)


def stores_refused_types(slave: CanopenSlave) -> Bends:
    """Refuse reserved transmission types, and take them all the same."""
    for entry in slave.dictionary:
        if entry.sub == 2 and entry.index in (*range(0x1400, 0x1600), *range(0x1800, 0x1A00)):
            entry.guard = _storing(entry.guard)
    return Bends()


def _storing(guard: Callable[[Entry, Value], None] | None) -> Callable[[Entry, Value], None]:
    def check(entry: Entry, value: Value) -> None:
        try:
            if guard is not None:
                guard(entry, value)
        except SdoAbort:
            entry.assign(entry.data_type.encode(value))
            raise

    return check


def at_wrong_toggle(answer: Callable[[str, str], str]) -> Plant:
    """Answer an upload segment request with the wrong toggle bit, and let the transfer go on."""

    def plant(slave: CanopenSlave) -> Bends:
        running, last, named, due = [False], [""], [""], [0]

        def hear(text: str) -> Iterable[str]:
            head = _byte(text, 0) if text.startswith(REQUEST) else 0
            if running[0] and last[0] and head & 0xE0 == 0x60 and head & TOGGLE != due[0]:
                slave.put(CanFrame.parse(answer(last[0], named[0])))
                slave.due_us = 0
                return ()
            return (text,)

        def say(text: str) -> Iterable[str]:
            head = _byte(text, 0) if text.startswith(RESPONSE) else -1
            if head == 0x41:
                running[0], last[0], named[0], due[0] = True, "", text[6:12], 0
            elif head == 0x80 and text[-8:] != "00000305":
                running[0] = False
            elif running[0] and head >= 0 and not head & 0xE0 and text != last[0]:
                last[0], due[0] = text, due[0] ^ TOGGLE
                running[0] = not head & 1
            return (text,)

        return Bends(hear, say)

    return plant


def keeps_part_of_aborted(slave: CanopenSlave) -> Bends:
    """Write what has come of a segmented download when the client aborts it."""

    def hear(text: str) -> Iterable[str]:
        transfer = getattr(SdoServers.of(slave).default._state, "__self__", None)
        if text.startswith("605#80") and isinstance(transfer, SegmentedDownload):
            entry, came = transfer._entry, bytes(transfer._data)
            entry.assign((came + entry.data[len(came) :])[: entry.size or None])
        return (text,)

    return Bends(hear)


def first_block_size_stays(slave: CanopenSlave) -> Bends:
    """Send all blocks of an upload with the block size of the first."""
    size = [0]

    def hear(text: str) -> Iterable[str]:
        if re.match("605#A[04]", text):
            size[0] = _byte(text, 4)
        return (_with_byte(text, 2, size[0]) if text.startswith("605#A2") else text,)

    return Bends(hear)


def at_most(segments: int) -> Plant:
    """Send no more segments in a block of an upload, whatever the client asks for."""

    def hear(text: str) -> Iterable[str]:
        place = 4 if re.match("605#A[04]", text) else 2 if text.startswith("605#A2") else 0
        byte = _byte(text, place)
        return (_with_byte(text, place, segments) if place and segments < byte < 128 else text,)

    return lambda slave: Bends(hear)


def repeats_nothing(slave: CanopenSlave) -> Bends:
    """Go on behind the last segment of a block, whatever the client has acknowledged."""
    sent = [0]

    def hear(text: str) -> Iterable[str]:
        return (_with_byte(text, 1, sent[0]) if text.startswith("605#A2") else text,)

    def say(text: str) -> Iterable[str]:
        if text.startswith(RESPONSE):
            sent[0] = _byte(text, 0) & 0x7F
        return (text,)

    return Bends(hear, say)


def fills_gaps(slave: CanopenSlave) -> Bends:
    """Take zeros for the segments of a block download that are lost."""
    running, seqno = [False], [0]

    def hear(text: str) -> Iterable[str]:
        if not running[0] or not text.startswith(REQUEST) or text.startswith("605#80"):
            return (text,)
        head = _byte(text, 0)
        lost = range(seqno[0] + 1, head & 0x7F)
        seqno[0], running[0] = head & 0x7F, head < 0x80
        return (*(f"605#{number:02X}{'00' * 7}" for number in lost), text)

    def say(text: str) -> Iterable[str]:
        if re.match("585#A[024]", text):
            running[0], seqno[0] = running[0] or text[5] != "2", 0
        elif text.startswith(("585#A1", "585#80")):
            running[0] = False
        return (text,)

    return Bends(hear, say)


def keeps_the_fill(slave: CanopenSlave) -> Bends:
    """Keep the bytes of the last segment of a block download that carry no data."""
    place, fill = [b""], [0]

    def hear(text: str) -> Iterable[str]:
        if re.match("605#C[0246]", text):
            place[0] = bytes.fromhex(text[6:12])
        elif text.startswith(REQUEST) and _byte(text, 0) & 0xE3 == 0xC1:
            fill[0] = _byte(text, 0) >> 2 & 7
        return (text,)

    def say(text: str) -> Iterable[str]:
        if text.startswith("585#A1"):
            entry = slave.dictionary.look_up(place[0])
            entry.assign(entry.data + (b"" if entry.size else bytes(fill[0])))
        return (text,)

    return Bends(hear, say)


# PDO


def _rpdo_data(make: Callable[[bytes, tuple[Any, ...]], bytes]) -> Plant:
    """Give RPDOs other bytes: made of those that came, and of what is mapped."""

    def plant(slave: CanopenSlave) -> Bends:
        def hear(text: str) -> Iterable[str]:
            frame = CanFrame.parse(text)
            for rpdo in PdoConsumer.of(slave).rpdos:
                slots = rpdo.mapping.slots()
                if rpdo.parameters.valid and rpdo.parameters.can_id == frame.can_id and slots:
                    return (f"{text[:4]}{make(frame.data, slots).hex().upper()}",)
            return (text,)

        return Bends(hear)

    return plant


def _filled(data: bytes, slots: tuple[Any, ...]) -> bytes:
    return data.ljust(total_bits(slots) // 8, b"\0")


def _without_dummies(data: bytes, slots: tuple[Any, ...]) -> bytes:
    if all(slot.entry is not None for slot in slots) or any(slot.bits % 8 for slot in slots):
        return data
    made, at = b"", 0
    for slot in slots:
        size = slot.bits // 8
        made += bytes(size) if slot.entry is None else data[at : at + size]
        at += 0 if slot.entry is None else size
    return made


def marks_at_sync(slave: CanopenSlave) -> Bends:
    """Send TPDOs of type 0 with each SYNC."""

    def hear(text: str) -> Iterable[str]:
        if text.startswith("080#"):
            for tpdo in PdoProducer.of(slave).tpdos:
                if isinstance(tpdo.mode, SynchronousAcyclic):
                    tpdo.mode.request()
        return (text,)

    return Bends(hear)


class TimedCyclic(SynchronousCyclic):
    """Types 1 to 240 that the event timer sends as well."""

    timed: ClassVar[bool] = True

    def __init__(self, sender: PdoSender, now_us: int) -> None:
        super().__init__(sender)
        self.retime(now_us)

    def run(self, now_us: int) -> None:
        self.sender.send()
        self.retime(now_us)

    def retime(self, now_us: int) -> None:
        event_us = self.sender.parameters.event_us
        self.due_us = now_us + event_us if event_us else NEVER
        self.sender.wake(self.due_us)


class TimesSynchronous(PdoProducer):
    """Lets the event timer send synchronous TPDOs."""

    def _collect(self) -> None:
        for tpdo in self.tpdos:
            if type(tpdo.mode) is SynchronousCyclic:
                tpdo.mode = TimedCyclic(tpdo, self.node.now_us)
        super()._collect()


class FetchedOnChange(PdoProducer):
    """Sends TPDOs of type 253 on a change too."""

    def _collect(self) -> None:
        for tpdo in self.tpdos:
            if type(tpdo.mode) is TpdoMode:
                tpdo.mode = EventDriven(tpdo)
                tpdo._watch(tpdo.entries)
        super()._collect()


class BigEndian(PdoProducer):
    """Sends values of 64 bits with the high byte first."""

    def _collect(self) -> None:
        for tpdo in self.tpdos:
            if any(entry.size == 8 for entry in tpdo.entries):
                tpdo._alone = None
                tpdo.pack = _Reversed.of(tpdo.pack)
        super()._collect()


class _Reversed:
    """Packs backwards."""

    def __init__(self, pack: Pack) -> None:
        self._pack = pack

    @classmethod
    def of(cls, pack: Pack) -> Pack:
        return pack if isinstance(pack, _Reversed) else cls(pack)

    def __call__(self) -> bytes:
        return self._pack()[::-1]


class MapsAtStart(PdoProducer):
    """Sends what was mapped when the node was started."""

    def changed(self, tpdo: Tpdo) -> None:
        if not tpdo.entries:
            super().changed(tpdo)
            return
        before = tpdo.pack, tpdo._alone, tpdo.entries
        super().changed(tpdo)
        tpdo.pack, tpdo._alone, tpdo.entries = before


class SwitchesOffAtStart(PdoProducer):
    """Goes on sending a TPDO that is switched off while the node is Operational."""

    def changed(self, tpdo: Tpdo) -> None:
        if tpdo.parameters.valid:
            super().changed(tpdo)


class TimerBeforeInhibit(PdoProducer):
    """Sends by the event timer within the inhibit time."""

    def tick(self, now_us: int) -> None:
        for mode in self._timed:
            if isinstance(mode, EventDriven) and not mode._marked and mode.due_us <= now_us:
                mode._free_us = 0
        super().tick(now_us)


# SYNC


class CountsOn(Sync):
    """Goes on counting where it was Stopped."""

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        counter = self._counter
        super().state_changed(old, new)
        if NmtState.STOPPED in (old, new) and NmtState.INITIALISING not in (old, new):
            self._counter = counter


class HearsBoth(Sync):
    """Listens to 080h too where SYNC has another CAN-ID."""

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        for can_id, receive in super().handlers(state):
            yield from dict.fromkeys((can_id, 0x080), receive).items()


# EMCY, error behaviour


def register_lags(slave: CanopenSlave) -> Bends:
    """Tell in an EMCY message the error register of the one before."""
    told = ["00"]

    def say(text: str) -> Iterable[str]:
        if text == "705#00":
            told[0] = "00"
        if not text.startswith("085#"):
            return (text,)
        before, told[0] = told[0], text[8:10]
        return (f"{text[:8]}{before}{text[10:]}",)

    return Bends(say=say)


class CountsOldErrors(EmcyProducer):
    """Has the old errors in 1003h again with the next one after 0 was written."""

    _seen = 0

    def start(self) -> None:
        self._seen = 0
        super().start()

    def emergency(self, code: int, register: int, text: bytes) -> None:
        count = self._history._count
        if count is not None and not count.number:
            count.assign(bytes([self._seen]))
        super().emergency(code, register, text)
        self._seen = count.number if count is not None else 0


class ActsOnce(ErrorBehaviour):
    """Acts on the first communication error alone."""

    _acted = False

    def start(self) -> None:
        self._acted = False
        super().start()

    def communication_error(self) -> None:
        if not self._acted:
            self._acted = True
            super().communication_error()


# Store, LSS, objects


class RestoresAtOnce(ParameterStore):
    """Has the default values when "load" is written."""

    def _load(self, area: range) -> None:
        super()._load(area)
        for entry in self.node.dictionary:
            if entry.index in area and self._is_parameter(entry):
                entry.force(entry.description.power_on_data(self.node.node_id))


class NodeIdAtOnce(LssSlave):
    """Uses a configured node-ID before the next reset."""

    def _receive(self, frame: CanFrame) -> None:
        super()._receive(frame)
        node = self.node
        if frame.data[:1] == b"\x11" and UNCONFIGURED not in (node.node_id, node.pending_id):
            node.node_id = node.pending_id
            SdoServers.of(node).start()
            node.rewire()


class OpenRange(LssSlave):
    """Identifies itself only inside of the range of revision and serial number."""

    def start(self) -> None:
        self._identify = MessageSequence(((0, eq), (1, eq), (2, lt), (2, gt), (3, lt), (3, gt)))
        super().start()


def keeps_the_tail(slave: CanopenSlave) -> Bends:
    """Keep the end of a string where a shorter one is written."""
    for entry in slave.dictionary:
        if entry.data_type is DataType.VISIBLE_STRING and entry.description.writable:
            _keep_tail(entry)
    return Bends()


def _keep_tail(entry: Entry) -> None:
    before = [b""]

    def guard(entry: Entry, value: Value) -> None:
        before[0] = entry.data

    def written(entry: Entry) -> None:
        entry.assign(entry.data + before[0][len(entry.data) :])

    entry.guard, entry.written = guard, written


DEFECTS: Final[tuple[Defect, ...]] = (
    Defect("reset communication of all nodes is ignored", ("NMT-22",), hears("000#8200")),
    Defect(
        "reset communication resets the application too",
        ("NMT-10",),
        hears("000#82(0[05])", r"000#81\1"),
    ),
    Defect("boot-up when Stopped is left", ("NMT-24",), services={NmtSlave: BootsFromStopped}),
    Defect("1017h counts once 0 was written", ("HB-02",), services={HeartbeatProducer: PeriodKept}),
    Defect("the heartbeat tells the state before", ("HB-19",), tells_old_state),
    Defect("1016h with a time of 8 bits", ("HB-20",), services={HeartbeatConsumer: ShortTimes}),
    Defect(
        "heartbeats of a Stopped node are none",
        ("HB-21",),
        services={HeartbeatConsumer: StoppedIsLost},
    ),
    Defect("1016h with time 0 monitors on", ("HB-18",), services={HeartbeatConsumer: NeverEnds}),
    Defect("the guarding toggle survives a reset", ("NG-03",), services={NodeGuarding: ToggleKept}),
    Defect("life time without its factor", ("NG-05",), services={NodeGuarding: NoFactor}),
    Defect(
        "life guarding leaves Operational", ("NG-08",), services={NodeGuarding: GuardsWithoutAct}
    ),
    Defect("an abort names the transfer before", ("UE-06", "UE-07"), abort_names_the_one_before),
    Defect("a refused transmission type is stored", ("PC-19",), stores_refused_types),
    Defect(
        "a wrong toggle repeats the segment", ("US-11",), at_wrong_toggle(lambda last, named: last)
    ),
    Defect(
        "an upload goes on behind a wrong toggle",
        ("US-11",),
        at_wrong_toggle(lambda last, named: f"585#80{named}00000305"),
    ),
    Defect("an aborted download leaves a part", ("DS-10",), keeps_part_of_aborted),
    Defect("the block size of an acknowledgement is ignored", ("BU-09",), first_block_size_stays),
    Defect("a block of an upload has 64 segments at most", ("BU-11",), at_most(64), left=True),
    Defect("lost segments of an upload are not repeated", ("BU-06",), repeats_nothing),
    Defect("a lost segment of a download is zeros", ("BD-05",), fills_gaps),
    Defect("the fill of a block download is data", ("BD-03",), keeps_the_fill),
    Defect("a short RPDO is filled with zeros", ("PR-14",), _rpdo_data(_filled)),
    Defect("dummies of an RPDO take no room", ("PC-15",), _rpdo_data(_without_dummies)),
    Defect("type 0 is sent with each SYNC", ("PR-07",), marks_at_sync),
    Defect("the event timer sends type 1", ("PR-30",), services={PdoProducer: TimesSynchronous}),
    Defect("type 253 is sent on a change", ("PR-29",), services={PdoProducer: FetchedOnChange}),
    Defect("a TPDO has the mapping of the start", ("PR-31",), services={PdoProducer: MapsAtStart}),
    Defect(
        "a TPDO is off after the next start", ("PR-32",), services={PdoProducer: SwitchesOffAtStart}
    ),
    Defect(
        "the event timer ignores the inhibit time",
        ("PR-33",),
        services={PdoProducer: TimerBeforeInhibit},
    ),
    Defect(
        "64 bits in a TPDO with the high byte first", ("PR-18",), services={PdoProducer: BigEndian}
    ),
    Defect(
        "the SYNC counter goes on behind Stopped", ("SY-17",), services={Sync: CountsOn}, left=True
    ),
    Defect("080h is SYNC too", ("SY-07",), services={Sync: HearsBoth}),
    Defect(
        "the error reset tells register 0",
        ("EM-19",),
        says(r"085#0000..(\w*)", r"085#000000\1"),
    ),
    Defect("EMCY tells the register before", ("EM-02",), register_lags),
    Defect("1003h has old errors again", ("EM-06",), services={EmcyProducer: CountsOldErrors}),
    Defect("1029h acts once", ("HB-22",), services={ErrorBehaviour: ActsOnce}),
    Defect("restore acts at once", ("ST-05",), services={ParameterStore: RestoresAtOnce}),
    Defect("an LSS node-ID counts at once", ("LS-04",), services={LssSlave: NodeIdAtOnce}),
    Defect(
        "LSS identify excludes the bounds", ("LS-23",), services={LssSlave: OpenRange}, left=True
    ),
    Defect("a shorter string keeps the tail", ("DE-18",), keeps_the_tail),
)
