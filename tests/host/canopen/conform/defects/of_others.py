"""Defects made from the text alone, by somebody who had not read the checks."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from operator import eq, gt, lt
from typing import Any, ClassVar, Final

from tests.host.canopen.conform.defects.defect import Bends, Defect, Plant, hears, says, together
from tests.host.canopen.conform.defects.of_clauses import keeping, loses
from tickrig.device.canopen.dictionary import Entry, SdoAbort
from tickrig.device.canopen.errors import EmcyProducer, ErrorBehaviour
from tickrig.device.canopen.lss import SELECTIVE, FastScanner, LssSlave, MessageSequence
from tickrig.device.canopen.nmt import (
    HeartbeatConsumer,
    HeartbeatProducer,
    Monitor,
    NmtSlave,
    NodeGuarding,
)
from tickrig.device.canopen.parameter_store import STORE_PARAMETERS, ParameterStore
from tickrig.device.canopen.pdo.pdo_mapping import Pack, total_bits
from tickrig.device.canopen.pdo.pdo_parameters import (
    EventDriven,
    SynchronousAcyclic,
    SynchronousCyclic,
    TpdoMode,
)
from tickrig.device.canopen.pdo.rpdo import PdoConsumer
from tickrig.device.canopen.pdo.tpdo import PdoProducer, Tpdo
from tickrig.device.canopen.sdo import SdoServers, SegmentedDownload
from tickrig.device.canopen.slave import ALIVE, UNCONFIGURED, CanopenSlave, Handler
from tickrig.device.canopen.sync import Sync, TimeStamp
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.emcy import EmcyCode, ErrorRegister
from tickrig.wire.canopen.lss import FastScan, LssAddress, LssMode
from tickrig.wire.canopen.nmt import CAN_ID_MASK, ERROR_CONTROL_COB_ID, NmtState
from tickrig.wire.canopen.sdo_frame import crc16
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

    def __init__(self, sender: Tpdo, now_us: int) -> None:
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


# The second set: written, as the first, before the checks were read.


class KeepsDefaultsOnce(ParameterStore):
    """Has the stored values again behind the first reset after "load"."""

    def __init__(self, node: CanopenSlave, slot: int) -> None:
        super().__init__(node, slot)
        self._forgotten: dict[int, bytes] = {}

    def _load(self, area: range) -> None:
        stored = self.node.nonvolatile.parameters
        self._forgotten = {key: data for key, data in stored.items() if key >> 8 in area}
        super()._load(area)

    def start(self) -> None:
        super().start()
        self.node.nonvolatile.parameters.update(self._forgotten)
        self._forgotten = {}


class ShowsSignature(ParameterStore):
    """Reads "save" in 1010h once it was written."""

    def _act(self, entry: Entry) -> None:
        signature = entry.data
        super()._act(entry)
        if entry.index == STORE_PARAMETERS:
            entry.assign(signature)


def stores_later_changes(slave: CanopenSlave) -> Bends:
    """Store with a reset what was changed since "save"."""
    saved = [False]

    def hear(text: str) -> Iterable[str]:
        if re.match("605#231[01]1001(73617665|6C6F6164)", text):
            saved[0] = text[7] == "0"
        elif saved[0] and re.match("000#8[12]0[05]", text):
            ParameterStore.of(slave)._save(range(0x1_0000))
        return (text,)

    return Bends(hear)


def answers_later(slave: CanopenSlave) -> Bends:
    """Keep an SDO request that came in Stopped, and answer it when Stopped is left."""
    kept: list[str] = []

    def hear(text: str) -> Iterable[str]:
        if slave.state is NmtState.STOPPED and text.startswith(REQUEST):
            kept[:] = [text]
        elif kept and re.match("000#(01|80)0[05]", text):
            return (text, kept.pop())
        elif text.startswith("000#8"):
            kept.clear()
        return (text,)

    return Bends(hear)


def of_block_upload(change: Callable[[str, int, list[str]], str]) -> Plant:
    """Change the segments and the end of block uploads.

    Args:
        change: makes a frame of a frame, the block size, and the segments of the block so far;
            with these and the frame itself if it is a segment.
    """

    def plant(slave: CanopenSlave) -> Bends:
        size, block, running = [0], list[str](), [False]

        def hear(text: str) -> Iterable[str]:
            if re.match("605#A[04]", text):
                size[0], running[0] = _byte(text, 4), False
            elif text.startswith("605#A3"):
                running[0] = True
                block.clear()
            elif text.startswith("605#A2"):
                size[0] = _byte(text, 2)
            elif text.startswith(REQUEST):
                running[0] = False
            return (text,)

        def say(text: str) -> Iterable[str]:
            if not running[0] or not text.startswith(RESPONSE):
                return (text,)
            if text.startswith("585#80"):
                running[0] = False
                return (text,)
            ended = bool(block) and _byte(block[-1], 0) >= 0x80
            if _byte(text, 0) & 0x7F == 1:
                block.clear()
                ended = False
            if not ended:
                block.append(text)
            return (change(text, size[0], block),)

        return Bends(hear, say)

    return plant


def _crc_of_block(text: str, size: int, block: list[str]) -> str:
    head = _byte(text, 0)
    if text in block or head & 0xE3 != 0xC1 or text[6:10] == "0000":
        return text
    data = b"".join(bytes.fromhex(segment[6:]) for segment in block)
    crc = crc16(data[: len(data) - (head >> 2 & 7)])
    return f"{text[:6]}{crc.to_bytes(2, 'little').hex().upper()}{text[10:]}"


def _last_of_each_block(text: str, size: int, block: list[str]) -> str:
    head = _byte(text, 0)
    return _with_byte(text, 0, head | 0x80) if text in block and head == size else text


def counts_on(slave: CanopenSlave) -> Bends:
    """Go on with the sequence number in the next block of an upload."""
    before, latest = [0], [0]

    def change(text: str, size: int, block: list[str]) -> str:
        head = _byte(text, 0)
        if text not in block:
            return text
        if head & 0x7F == 1:
            before[0] = latest[0]
        latest[0] = (before[0] + (head & 0x7F) - 1) % 127 + 1
        return _with_byte(text, 0, head & 0x80 | latest[0])

    def hear(text: str) -> Iterable[str]:
        if text.startswith("605#A3"):
            before[0] = latest[0] = 0
        return (text,)

    return together(lambda slave: Bends(hear), of_block_upload(change))(slave)


def switches_above(slave: CanopenSlave) -> Bends:
    """Switch from block to segmented upload above the threshold, not below."""

    def hear(text: str) -> Iterable[str]:
        threshold = _byte(text, 5)
        if re.match("605#A[04]", text) and threshold > 0:
            entry = slave.dictionary.find(int(text[8:10] + text[6:8], 16), int(text[10:12], 16))
            above = entry is not None and len(entry.data) > threshold
            return (_with_byte(text, 5, 0xFF if above else 0),)
        return (text,)

    return Bends(hear)


def loses_one_byte(slave: CanopenSlave) -> Bends:
    """Take a last segment with one byte for an empty one."""

    def hear(text: str) -> Iterable[str]:
        transfer = getattr(SdoServers.of(slave).default._state, "__self__", None)
        if isinstance(transfer, SegmentedDownload) and re.match("605#[01]D", text):
            transfer._size.announced = (transfer._size.announced or 1) - 1
            return (_with_byte(text, 0, _byte(text, 0) | 0x0E),)
        return (text,)

    return Bends(hear)


def keeps_over(command: str, *areas: range) -> Plant:
    """Keep what was written to communication objects over a reset."""

    def plant(slave: CanopenSlave) -> Bends:
        kept: dict[Entry, bytes] = {}

        def hear(text: str) -> Iterable[str]:
            if re.match(f"000#{command}0[05]", text):
                kept.update(
                    (entry, entry.data)
                    for entry in slave.dictionary
                    if entry.description.writable and any(entry.index in area for area in areas)
                )
            return (text,)

        def say(text: str) -> Iterable[str]:
            if text == "705#00":
                for entry, data in kept.items():
                    entry.force(data)
                kept.clear()
            return (text,)

        return Bends(hear, say)

    return plant


class ToggleStands(NodeGuarding):
    """Keeps the toggle bit in Stopped."""

    def _receive(self, frame: CanFrame) -> None:
        before = self._toggle
        super()._receive(frame)
        if self.node.state is NmtState.STOPPED:
            self._toggle = before


class HeartbeatForEver(NodeGuarding):
    """Answers no guarding request once 1017h was set."""

    _set = False

    def start(self) -> None:
        self._set = False
        super().start()

    def _changed(self, entry: Entry) -> None:
        super()._changed(entry)
        self._set = self._set or super()._heartbeat_instead

    @property
    def _heartbeat_instead(self) -> bool:
        return self._set or super()._heartbeat_instead


class LosesEvents(EventDriven):
    """Loses events within the inhibit time."""

    def request(self, entry: Entry | None = None) -> None:
        if self.sender._node.now_us >= self._free_us:
            super().request(entry)


class TimerForEver(EventDriven):
    """Goes on with the event timer when 0 is written."""

    _event_us = 0

    def _time_anew(self, now_us: int) -> None:
        super()._time_anew(now_us)
        self._event_us = self.sender.parameters.event_us or self._event_us
        if self._event_us:
            self.due_us = now_us + self._event_us


def event_driven(mode: type[EventDriven]) -> type[PdoProducer]:
    """Return a producer whose event-driven TPDOs are others."""

    class Producer(PdoProducer):
        def _collect(self) -> None:
            for tpdo in self.tpdos:
                if type(tpdo.mode) is EventDriven:
                    for entry in tpdo._watched:
                        entry.unwatch(tpdo.mode.request)
                    tpdo.mode = mode(tpdo)
                    tpdo._watch(tpdo.entries)
            super()._collect()

    return Producer


def _from_its_end(data: bytes, slots: tuple[Any, ...]) -> bytes:
    length = (total_bits(slots) + 7) // 8
    over = len(data) - length
    return data[over:] + bytes(over) if over > 0 else data


def _short_dummies(data: bytes, slots: tuple[Any, ...]) -> bytes:
    if any(slot.bits % 8 for slot in slots):
        return data
    made, at = b"", 0
    for slot in slots:
        size = slot.bits // 8
        taken = 1 if slot.entry is None and size == 2 else size
        made += data[at : at + taken].ljust(size, b"\0")
        at += taken
    return made[: len(data)]


def _bits_from_the_top(data: bytes, slots: tuple[Any, ...]) -> bytes:
    if not any(slot.bits % 8 for slot in slots):
        return data
    return bytes(int(f"{byte:08b}"[::-1], 2) for byte in data)


class AnswersAlive(PdoProducer):
    """Answers remote requests in Pre-operational too."""

    def changed(self, tpdo: Tpdo) -> None:
        super().changed(tpdo)
        self.node.rewire()

    def remote_handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        yield from super().remote_handlers(state)
        if state is NmtState.PRE_OPERATIONAL:
            for tpdo in self.tpdos:
                if tpdo.parameters.valid and tpdo.parameters.answers_rtr:
                    yield tpdo.parameters.can_id, _sends_once(tpdo)


def _sends_once(tpdo: Tpdo) -> Handler:
    def handler(frame: CanFrame) -> None:
        tpdo.begin()
        tpdo.send()
        tpdo.end()

    return handler


class ShortWindow(PdoConsumer):
    """Has a synchronous window of a tenth of 1007h."""

    def _window_changed(self, window: Entry) -> None:
        self._window_us = window.number // 10


class WrapsToZero(Sync):
    """Counts 0 behind the overflow value."""

    def tick(self, now_us: int) -> None:
        if self._due_us == NEVER or not self.overflow:
            super().tick(now_us)
            return
        self._due_us += self.period_us
        self.schedule(self._due_us)
        self._counter = (self._counter + 1) % (self.overflow + 1)
        self.node.send(self.can_id, bytes([self._counter]))
        self._announce(self._counter)


class NotesResets(EmcyProducer):
    """Has in 1003h that an error is gone, too."""

    def emergency_clear(self, code: int, text: bytes | None) -> None:
        before = len(self._active)
        super().emergency_clear(code, text)
        for _ in range(before - len(self._active)):
            self._history.note(EmcyCode.NO_ERROR, b"")


class ActsOnEach(ErrorBehaviour):
    """Acts on each error as on one of communication."""

    def emergency(self, code: int, register: int, text: bytes) -> None:
        if not register & ErrorRegister.COMMUNICATION:
            self.communication_error()


class StoresActive(LssSlave):
    """Stores the node-ID that it has, not the one it was given."""

    def _receive(self, frame: CanFrame) -> None:
        stored = self.node.nonvolatile.node_id
        super()._receive(frame)
        if self.node.nonvolatile.node_id != stored:
            self.node.nonvolatile.node_id = self.node.node_id


class _AnyPart(FastScanner):
    """Answers for every part of the LSS address at any time."""

    def take(self, request: FastScan, address: LssAddress) -> LssMode | None:
        self._sub = request.sub & 3
        return super().take(request, address)


class _Waits(FastScanner):
    """Does not go to configuration at the end."""

    def take(self, request: FastScan, address: LssAddress) -> LssMode | None:
        mode = super().take(request, address)
        return None if mode is None else LssMode.WAITING


class _WithoutVendor(MessageSequence):
    """Does without its first message."""

    def take(self, step: int, address: LssAddress, number: int) -> bool:
        if step == 1 and self._step != 1:
            self._step = 1
        return super().take(step, address, number)


class ScansAnyPart(LssSlave):
    """Answers fastscan for every part of the LSS address."""

    def start(self) -> None:
        self._fastscan = _AnyPart()
        super().start()


class ScansAndWaits(LssSlave):
    """Stays in waiting at the end of a fastscan."""

    def start(self) -> None:
        self._fastscan = _Waits()
        super().start()


class SwitchesWithoutVendor(LssSlave):
    """Switches to configuration without the vendor-ID."""

    def start(self) -> None:
        self._selective = _WithoutVendor(SELECTIVE)
        super().start()


class StaysInConfiguration(LssSlave):
    """Does not go back to waiting with a reset."""

    def power_on(self) -> None:
        super().power_on()
        self._mode = LssMode.WAITING

    def start(self) -> None:
        mode = self._mode
        super().start()
        self._mode = mode


class AlwaysTime(TimeStamp):
    """Consumes TIME without bit 31 of 1012h."""

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        if state in ALIVE:
            yield self._number & CAN_ID_MASK, self._receive


class TimeOn100h(TimeStamp):
    """Consumes TIME on 100h alone."""

    def handlers(self, state: NmtState) -> Iterator[tuple[int, Handler]]:
        for _, receive in super().handlers(state):
            yield 0x100, receive


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
    # The second set.
    Defect(
        "1010h takes the signature of 1011h",
        ("ST-02",),
        hears("605#231010016C6F6164", "605#2310100173617665"),
    ),
    Defect(
        "load holds for one reset",
        ("ST-09",),
        services={ParameterStore: KeepsDefaultsOnce},
        left=True,
    ),
    Defect("reset node loads nothing stored", ("ST-10",), loses(range(0x1_0000), command="81")),
    Defect("1010h reads the signature", ("ST-11",), services={ParameterStore: ShowsSignature}),
    Defect("what changes behind save is stored", ("ST-12",), stores_later_changes),
    Defect("a request in Stopped is answered later", ("NMT-13",), answers_later),
    Defect(
        "a block download without its size is refused",
        ("BD-13",),
        hears("605#C([04])(.{6}).*", r"605#C2\2FFFFFFFF"),
    ),
    Defect(
        "the CRC of an upload is that of its last block", ("BU-09",), of_block_upload(_crc_of_block)
    ),
    Defect("seqno goes on in the next block of an upload", ("BU-09",), counts_on),
    Defect("each block of an upload is its last", ("BU-09",), of_block_upload(_last_of_each_block)),
    Defect("the threshold of a block upload is the least size", ("BU-15",), switches_above),
    Defect("a last segment of one byte is lost", ("DS-12",), loses_one_byte),
    Defect(
        "a string of 0 bytes is confirmed and not taken",
        ("DS-13",),
        keeping("2007:00", lambda new, old: new or old),
        left=True,
    ),
    Defect(
        "a time-out names no object", ("US-12",), says("585#80.{6}(00000405)", r"585#80000000\1")
    ),
    Defect("NMT commands for 85h are obeyed", ("NMT-07",), hears("000#(..)85", r"000#\g<1>05")),
    Defect(
        "reset communication keeps mappings",
        ("NMT-29",),
        keeps_over("82", range(0x1600, 0x1800), range(0x1A00, 0x1C00)),
    ),
    Defect("reset node keeps 1000h to 1FFFh", ("NMT-11",), keeps_over("81", range(0x1005, 0x1029))),
    Defect(
        "the guarding toggle stands in Stopped", ("NG-09",), services={NodeGuarding: ToggleStands}
    ),
    Defect("no guarding once 1017h was set", ("NG-10",), services={NodeGuarding: HeartbeatForEver}),
    Defect(
        "an event within the inhibit time is lost",
        ("PR-03",),
        services={PdoProducer: event_driven(LosesEvents)},
    ),
    Defect("a long RPDO is taken from its end", ("PR-15",), _rpdo_data(_from_its_end)),
    Defect("a dummy of 16 bits takes 8", ("PC-31",), _rpdo_data(_short_dummies)),
    Defect("bits of an RPDO begin at the top", ("PR-36",), _rpdo_data(_bits_from_the_top)),
    Defect("remote requests in Pre-operational", ("PR-34",), services={PdoProducer: AnswersAlive}),
    Defect("event timer 0 goes on", ("PR-35",), services={PdoProducer: event_driven(TimerForEver)}),
    Defect("a tenth of the synchronous window", ("SY-18",), services={PdoConsumer: ShortWindow}),
    Defect("the SYNC counter wraps to 0", ("SY-03",), services={Sync: WrapsToZero}),
    Defect("1003h has error resets", ("EM-20",), services={EmcyProducer: NotesResets}, left=True),
    Defect(
        "1029h acts on each error", ("EM-21",), services={ErrorBehaviour: ActsOnEach}, left=True
    ),
    Defect("LSS stores the active node-ID", ("LS-08",), services={LssSlave: StoresActive}),
    Defect("fastscan of any part", ("LS-24",), services={LssSlave: ScansAnyPart}),
    Defect("fastscan ends in waiting", ("LS-17",), services={LssSlave: ScansAndWaits}),
    Defect(
        "LSS selective without vendor-ID", ("LS-22",), services={LssSlave: SwitchesWithoutVendor}
    ),
    Defect(
        "LSS configuration survives a reset",
        ("LS-25",),
        services={LssSlave: StaysInConfiguration},
        left=True,
    ),
    Defect("TIME without bit 31 of 1012h", ("SY-19",), services={TimeStamp: AlwaysTime}),
    Defect("TIME on 100h alone", ("SY-20",), services={TimeStamp: TimeOn100h}),
)
BLOCKS: Final = Defect("an abort names the transfer before", (), abort_names_the_one_before)
"""Ends a run before the first check: the object that the tester asks for never gets an answer."""
