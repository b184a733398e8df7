"""Defects made from the clauses of CiA 301 and CiA 305, some for each service."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import Final

from tests.host.canopen.conform.defects.defect import (
    Bends,
    Defect,
    Plant,
    acts_as,
    hears,
    says,
    together,
)
from tests.host.canopen.conform.defects.of_pdo import all_act_as
from tickrig.device.canopen.dictionary import Entry
from tickrig.device.canopen.errors import EmcyProducer
from tickrig.device.canopen.nmt import NmtSlave
from tickrig.device.canopen.pdo.rpdo import PdoConsumer
from tickrig.device.canopen.pdo.tpdo import PdoProducer
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.canopen.sync import Sync
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import NmtState

INVALID: Final = 1 << 31
TPDO1: Final = "185#"
PDOS: Final = range(4)


def on_hearing(prefix: str, act: str) -> Plant:
    """Send a frame by itself where one is heard that begins so."""

    def plant(slave: CanopenSlave) -> Bends:
        def hear(text: str) -> Iterable[str]:
            if text.startswith(prefix):
                slave.put(CanFrame.parse(act))
                slave.due_us = 0
            return (text,)

        return Bends(hear)

    return plant


def restarts_event_timers(prefix: str) -> Plant:
    """Restart the event timers of TPDOs where a frame is heard that begins so."""

    def plant(slave: CanopenSlave) -> Bends:
        def hear(text: str) -> Iterable[str]:
            if text.startswith(prefix) and slave.state is NmtState.OPERATIONAL:
                for tpdo in PdoProducer.of(slave).tpdos:
                    tpdo.mode.retime(slave.now_us)
                slave.due_us = 0
            return (text,)

        return Bends(hear)

    return plant


def last_segment_of_seven(instead: str) -> Plant:
    """Say otherwise how many bytes a last segment of seven has: its first byte, by the toggle."""
    return says("585#([01])1(.{14})", rf"585#\g<1>{instead}\2")


def empty_segment_behind(slave: CanopenSlave) -> Bends:
    """Send the last seven bytes as if more came, then a segment without bytes."""
    due = [False]

    def hear(text: str) -> Iterable[str]:
        if due[0] and text.startswith(("605#6", "605#7")):
            due[0] = False
            slave.put(CanFrame.parse(f"585#{int(text[4], 16) - 6:X}F00000000000000"))
            slave.due_us = 0
            return ()
        return (text,)

    def say(text: str) -> Iterable[str]:
        if text[:4] == "585#" and text[4] in "01" and text[5] == "1":
            due[0] = True
            return (f"585#{text[4]}0{text[6:]}",)
        return (text,)

    return Bends(hear, say)


class Burst(EmcyProducer):
    """Sends all that waited when the inhibit time is over."""

    def tick(self, now_us: int) -> None:
        if self._free_us and self._free_us <= now_us and len(self._queue) > 1:
            waiting, self._queue = self._queue, []
            for data in waiting:
                self.node.send(0x85, data)
            return
        super().tick(now_us)


class Newest(EmcyProducer):
    """Lets of what waits only the newest be sent."""

    def _queue_message(self, code: int, text: bytes) -> None:
        super()._queue_message(code, text)
        del self._queue[:-1]


class Latched(EmcyProducer):
    """Never clears 1001h."""

    def emergency_clear(self, code: int, text: bytes | None) -> None:
        super().emergency_clear(code, text)
        self.node.dictionary[0x1001, 0].assign(b"\1")


class Forgetful(EmcyProducer):
    """Clears 1001h when one of its errors goes."""

    def emergency_clear(self, code: int, text: bytes | None) -> None:
        super().emergency_clear(code, text)
        self.node.dictionary[0x1001, 0].assign(b"\0")


class Full(EmcyProducer):
    """Keeps the first errors when 1003h is full."""

    def emergency(self, code: int, register: int, text: bytes) -> None:
        fields = self.node.dictionary.elements(0x1003)
        full = self.node.dictionary[0x1003, 0].number == len(fields)
        kept = [entry.data for entry in fields] if full else []
        super().emergency(code, register, text)
        for entry, data in zip(fields, kept, strict=False):
            entry.force(data)


class AtTheTop(EmcyProducer):
    """Writes only sub-index 1 anew when 1003h is full."""

    def emergency(self, code: int, register: int, text: bytes) -> None:
        fields = self.node.dictionary.elements(0x1003)
        full = self.node.dictionary[0x1003, 0].number == len(fields)
        kept = [entry.data for entry in fields] if full else []
        super().emergency(code, register, text)
        for entry, data in zip(fields[1:], kept[1:], strict=False):
            entry.force(data)


class Rising(Sync):
    """Counts on beyond 1019h."""

    @property
    def overflow(self) -> int:
        return 240 if super().overflow else 0


class Hasty(Sync):
    """Produces without being told to by bit 30."""

    @property
    def _produces(self) -> bool:
        return True


class Tireless(Sync):
    """Produces in Stopped too."""

    def state_changed(self, old: NmtState, new: NmtState) -> None:
        if new is not NmtState.STOPPED:
            super().state_changed(old, new)


class Stubborn(Sync):
    """Keeps the period with which it began."""

    def tick(self, now_us: int) -> None:
        self._first = getattr(self, "_first", 0) or self.period_us
        super().tick(now_us)

    @property
    def period_us(self) -> int:
        now = super().period_us
        first: int = getattr(self, "_first", 0)
        if not now:
            self._first = 0
        return first or now if now else 0


class BusyAgain(NmtSlave):
    """Is Operational after a reset of communication."""

    _boots = 0

    def booted(self) -> None:
        super().booted()
        self._boots += 1
        if self._boots > 1:
            self.node.enter(NmtState.OPERATIONAL)


def loses(*areas: range, command: str = "82") -> Plant:
    """Do not load what was stored of some objects with a reset, by its NMT command."""

    def plant(slave: CanopenSlave) -> Bends:
        reset = [False]

        def hear(text: str) -> Iterable[str]:
            reset[0] = reset[0] or text.startswith(f"000#{command}")
            return (text,)

        def say(text: str) -> Iterable[str]:
            if text == "705#00" and reset[0]:
                reset[0] = False
                for entry in slave.dictionary:
                    if any(entry.index in area for area in areas) and entry.size:
                        entry.force(entry.description.power_on_data(slave.node_id))
            return (text,)

        return Bends(hear, say)

    return plant


def boots_once(slave: CanopenSlave) -> Bends:
    """Send no boot-up message after a reset of communication."""
    quiet = [False]

    def hear(text: str) -> Iterable[str]:
        if text.startswith("000#8"):
            quiet[0] = text.startswith("000#82")
        return (text,)

    def say(text: str) -> Iterable[str]:
        return () if text == "705#00" and quiet[0] else (text,)

    return Bends(hear, say)


def applies_again(slave: CanopenSlave) -> Bends:
    """Apply the data of a synchronous RPDO with each SYNC."""
    last: dict[str, str] = {}

    def hear(text: str) -> Iterable[str]:
        if text.startswith("205#") and "R" not in text:
            last["205"] = text
        elif text.startswith("000#8"):
            last.clear()
        elif text.startswith("080#") and slave.dictionary[0x1400, 2].number <= 240:
            return (*last.values(), text)
        return (text,)

    return Bends(hear)


def applies(state: NmtState | None = None, *, disabled: bool = False) -> Plant:
    """Apply RPDO1 where it should be ignored."""

    def plant(slave: CanopenSlave) -> Bends:
        def hear(text: str) -> Iterable[str]:
            if text.startswith("205#") and "R" not in text:
                rpdo = PdoConsumer.of(slave).rpdos[0]
                cob_id = slave.dictionary[0x1400, 1]
                off = disabled and cob_id.number & INVALID and slave.state is NmtState.OPERATIONAL
                if off or slave.state is state:
                    number = cob_id.number & ~INVALID
                    before = cob_id.data
                    cob_id.force(number.to_bytes(4, "little"))
                    handler = rpdo.listen()
                    if handler is not None:
                        handler(CanFrame.parse(text))
                    cob_id.force(before)
            return (text,)

        return Bends(hear)

    return plant


def sends_on_change(slave: CanopenSlave) -> Bends:
    """Send a synchronous TPDO on each change, too."""

    def changed(entry: Entry) -> None:
        for tpdo in PdoProducer.of(slave).tpdos:
            kind = slave.dictionary[0x1800 + tpdo.number - 1, 2].number
            ready = slave.state is NmtState.OPERATIONAL and tpdo.parameters.valid
            if ready and 1 <= kind <= 240 and entry in tpdo.entries:
                tpdo.send()
                slave.due_us = 0

    for entry in slave.dictionary:
        if entry.index >= 0x2000:
            entry.watch(changed)
    return Bends()


def sends_in_stopped(slave: CanopenSlave) -> Bends:
    def hear(text: str) -> Iterable[str]:
        if text.startswith("080#") and slave.state is NmtState.STOPPED:
            slave.send(0x185, bytes(2))
            slave.due_us = 0
        return (text,)

    return Bends(hear)


def forgets(*places: str) -> Plant:
    """Confirm what is written, and keep what was there."""
    return together(*(keeping(place, lambda new, old: old) for place in places))


def takes_low_byte(*places: str) -> Plant:
    """Take of a number its low byte only."""
    return together(
        *(keeping(place, lambda new, old: new[:1].ljust(len(new), b"\0")) for place in places)
    )


def keeping(place: str, keep: Callable[[bytes, bytes], bytes]) -> Plant:
    def plant(slave: CanopenSlave) -> Bends:
        index, sub = place.split(":")
        entry = slave.dictionary[int(index, 16), int(sub, 16)]
        before = [entry.data]

        def written(entry: Entry) -> None:
            entry.assign(keep(entry.data, before[0]))
            before[0] = entry.data

        entry.written = written
        return Bends()

    return plant


def commits_on(prefix: str) -> Plant:
    """Take into the string what has come of it, when a transfer is aborted."""

    def plant(slave: CanopenSlave) -> Bends:
        def hear(text: str) -> Iterable[str]:
            if text.startswith(prefix) and begun[0]:
                slave.dictionary[0x2007, 0].assign(b"half of it")
            begun[0] = text.startswith(("605#00", "605#01"))
            return (text,)

        begun = [False]
        return Bends(hear)

    return plant


def stores_refused(slave: CanopenSlave) -> Bends:
    """Refuse what is too long, and keep its first byte."""

    def hear(text: str) -> Iterable[str]:
        if text.startswith("605#23"):
            entry = slave.dictionary.find(int(text[8:10] + text[6:8], 16), int(text[10:12], 16))
            if entry is not None and entry.size == 1:
                entry.assign(bytes.fromhex(text[12:14]))
        return (text,)

    return Bends(hear)


def says_old_data_again(slave: CanopenSlave) -> Bends:
    """Send the first segment of an upload twice, in place of the second."""
    first = [""]

    def say(text: str) -> Iterable[str]:
        if text.startswith("585#00"):
            first[0] = text[6:]
        elif text.startswith("585#10"):
            return (f"585#10{first[0]}",)
        return (text,)

    return Bends(say=say)


def repeats_emcy_8130(slave: CanopenSlave) -> Bends:
    """Report a lost heartbeat again and again."""

    def say(text: str) -> Iterable[str]:
        if text.startswith("085#3081"):
            return (text, text)
        return (text,)

    return Bends(say=say)


def watches_first_only(slave: CanopenSlave) -> Bends:
    """Watch the first entry of 1016h alone."""
    return acts_as("1016:02", lambda value: value & ~0xFFFF)(slave)


def never_unwatches(slave: CanopenSlave) -> Bends:
    """Confirm time 0 for a node, and go on."""

    def hear(text: str) -> Iterable[str]:
        if text[:16] == "605#231610010000" and text[16:18] != "00":
            slave.put(CanFrame.parse("585#6016100100000000"))
            slave.due_us = 0
            return ()
        return (text,)

    return Bends(hear)


DEFECTS: Final = (
    # What others had planted.
    Defect("SYNC restarts the event timer", ("PR-25",), restarts_event_timers("080#")),
    Defect("n of a last segment of seven bytes is 7", ("US-10",), last_segment_of_seven("F")),
    Defect("EMCYs behind 1015h come in a burst", ("EM-15",), services={EmcyProducer: Burst}),
    Defect(
        "reset communication loads no stored PDO",
        ("NMT-21",),
        loses(range(0x1400, 0x1C00)),
    ),
    Defect("a full history is not shifted", ("EM-16",), services={EmcyProducer: Full}),
    Defect("type 1 is sent on change too", ("PR-26",), sends_on_change),
    Defect("a synchronous RPDO is applied with each SYNC", ("PR-27",), applies_again),
    # NMT and boot-up
    Defect("Stop for all nodes is not obeyed", ("NMT-22",), hears("000#0200")),
    Defect("reset communication for all nodes is not obeyed", ("NMT-22",), hears("000#8200")),
    Defect("Pre-operational for all nodes is not obeyed", ("NMT-22",), hears("000#8000")),
    Defect(
        "reset communication is not obeyed in Stopped",
        ("NMT-23",),
        hears("000#82..", only=NmtState.STOPPED),
    ),
    Defect(
        "Pre-operational is not obeyed in Stopped",
        ("NMT-17",),
        hears("000#8005", only=NmtState.STOPPED),
    ),
    Defect("29-bit NMT frames are commands", ("NMT-25",), hears("00000000#(..05)", r"000#\1")),
    Defect("boot-up says Pre-operational", ("NMT-01", "NMT-10"), says("705#00", "705#7F")),
    Defect("no boot-up after reset communication", ("NMT-10", "NMT-23"), boots_once),
    Defect("boot-up with Enter Pre-operational", ("NMT-24",), on_hearing("000#80", "705#00")),
    Defect("boot-up with Start", ("NMT-24",), on_hearing("000#01", "705#00")),
    Defect(
        "Operational after reset communication",
        ("NMT-28",),
        services={NmtSlave: BusyAgain},
        left=True,
    ),
    Defect("RPDO is applied in Stopped", ("NMT-26",), applies(NmtState.STOPPED)),
    Defect("TPDO in Stopped", ("NMT-27",), sends_in_stopped),
    # heartbeat and guarding
    Defect("no heartbeat in Stopped", ("NMT-04",), says("705#04")),
    Defect("no heartbeat in Operational", ("NMT-03",), says("705#05")),
    Defect("heartbeat with the toggle bit", ("HB-01",), says("705#7F", "705#FF")),
    Defect("heartbeat time in 10 ms", ("HB-01",), acts_as("1017:00", lambda ms: 10 * ms)),
    Defect("heartbeat of two bytes", ("HB-01", "NMT-03"), says("705#(7F|05)", r"705#\g<1>00")),
    Defect("only one heartbeat consumer works", ("HB-17",), watches_first_only),
    Defect("time 0 ends no watch", ("HB-18",), never_unwatches),
    Defect("heartbeat loss is told twice", ("HB-10",), repeats_emcy_8130),
    Defect(
        "guarding says Pre-operational in Operational", ("NG-02",), says("705#([08])5", r"705#7F")
    ),
    Defect(
        "life time factor ignored",
        ("NG-05",),
        acts_as("100D:00", lambda factor: 1 if factor else 0),
    ),
    Defect("life time twice as long", ("NG-05",), acts_as("100D:00", lambda factor: 2 * factor)),
    Defect(
        "guarding answers with two bytes", ("NG-01", "NG-02"), says("705#([7F]F)", r"705#\g<1>00")
    ),
    # SDO
    Defect(
        "upload names another sub-index", ("UE-01",), says("585#43001000(.*)", r"585#43001001\1")
    ),
    Defect("two answers to an upload", ("UE-15",), says("(585#43001000.*)", r"\1", r"\1")),
    Defect(
        "abort names sub-index 0", ("OD-1018-subs",), says("585#801810..(.*)", r"585#80181000\1")
    ),
    Defect(
        "abort code the wrong way round",
        ("UE-06", "UE-08"),
        says("585#80(......)(..)(..)(..)(..)", r"585#80\1\5\4\3\2"),
    ),
    Defect("u16 is confirmed and not taken", ("DE-02",), forgets("1015:00", "2001:00")),
    Defect("u8 is confirmed and not taken", ("DE-01",), forgets("2000:00", "100D:00")),
    Defect("u32 is cut to a byte", ("DE-03",), takes_low_byte("1007:00", "2002:00")),
    Defect(
        "download names another object",
        ("DE-01",),
        says("585#60(..)(..)(..)00000000", r"585#60\2\1\g<3>00000000"),
    ),
    Defect("what is too long is refused and kept", ("DE-05",), stores_refused),
    Defect(
        "toggle of an upload begins with 1",
        ("US-01", "OD-1008.00-type"),
        says("585#([01])([0-9A-F].{14})", r"585#1\2"),
    ),
    Defect("a segment is sent twice", ("OD-1008.00-type",), says_old_data_again),
    Defect("a segment without bytes behind the last", ("US-10",), empty_segment_behind),
    Defect("an indicated size of 0", ("US-01",), says("585#41(......).*", r"585#41\g<1>00000000")),
    Defect(
        "toggle of a download begins with 1", ("DS-12", "DS-02"), says("585#20(0{14})", r"585#30\1")
    ),
    Defect("an aborted download is taken", ("DS-10",), commits_on("605#80")),
    Defect(
        "n of a last segment is not looked at",
        ("DS-01", "DS-12"),
        hears("605#([01])[3579BD](.{14})", r"605#\g<1>1\2"),
    ),
    Defect("c of a last segment is not looked at", ("DS-01",), hears("605#0B(.*)", r"605#0A\1")),
    Defect(
        "block upload begins by itself",
        ("BU-14",),
        hears("605#A4(.*)", r"605#A4\1", "605#A300000000000000"),
    ),
    Defect("block upload counts from 0", ("BU-01",), says("585#01(.{14})", r"585#00\1")),
    Defect("n of a block upload of 14 bytes", ("BU-13",), says("585#C1(.{14})", r"585#DD\1")),
    Defect(
        "a block size of 0 is asked for",
        ("BD-01",),
        says("585#(A[04])(......)..(0{6})", r"585#\1\g<2>00\3"),
    ),
    Defect(
        "a block size of 255 is asked for",
        ("BD-01",),
        says("585#(A[04])(......)..(0{6})", r"585#\1\g<2>FF\3"),
    ),
    Defect("an aborted block download is taken", ("BD-09",), commits_on("605#80")),
    Defect(
        "requests to other nodes are answered",
        ("SG-08",),
        hears("6(?!05)..#4000(.*)", r"605#4000\1"),
    ),
    # PDO
    Defect("SDO restarts the event timer", ("PR-25",), restarts_event_timers("605#")),
    Defect(
        "event timer in 10 ms",
        ("PR-02",),
        together(*(acts_as(f"{0x1800 + n:04X}:05", lambda ms: 10 * ms) for n in PDOS)),
    ),
    Defect(
        "inhibit time in ms",
        ("PR-03",),
        together(*(acts_as(f"{0x1800 + n:04X}:03", lambda us: min(10 * us, 65_535)) for n in PDOS)),
    ),
    Defect(
        "inhibit time in us",
        ("PR-03",),
        together(*(acts_as(f"{0x1800 + n:04X}:03", lambda us: us // 100) for n in PDOS)),
    ),
    Defect("a disabled RPDO is applied", ("PR-28",), applies(disabled=True)),
    Defect(
        "TPDOs always have 8 bytes", ("PC-04", "PR-18"), says(r"185#((?:..){1,7})", r"185#\g<1>00")
    ),
    Defect("only the first mapped object is sent", ("PC-04",), says("185#(....)..", r"185#\1")),
    Defect(
        "a mapping is read back wrongly",
        ("PC-30",),
        says("585#4300160([12])..(.*)", r"585#4300160\g<1>07\2"),
    ),
    Defect("type 3 sends each time", ("PR-05",), all_act_as(0x1800, 2, {3: 1})),
    # SYNC
    Defect("SYNC without bit 30", ("SY-14",), services={Sync: Hasty}),
    Defect("SYNC in Stopped", ("SY-15",), services={Sync: Tireless}),
    Defect("the period of SYNC cannot be changed", ("SY-16",), services={Sync: Stubborn}),
    Defect("SYNC period in ms", ("SY-02",), acts_as("1006:00", lambda us: us * 10)),
    Defect("the SYNC counter goes on beyond 1019h", ("SY-03",), services={Sync: Rising}),
    # EMCY
    Defect("EMCY twice", ("EM-02",), says("(085#0050.*)", r"\1", r"\1")),
    Defect("no EMCY in Operational", ("EM-18",), says("085#.*", only=NmtState.OPERATIONAL)),
    Defect("only the newest EMCY comes behind 1015h", ("EM-15",), services={EmcyProducer: Newest}),
    Defect("1001h is never cleared", ("EM-03",), services={EmcyProducer: Latched}),
    Defect(
        "1001h is cleared with the first error that goes",
        ("EM-17",),
        services={EmcyProducer: Forgetful},
    ),
    Defect(
        "1003h has its code in the high word",
        ("EM-04", "EM-05"),
        says("585#430310(..)(....)(....)", r"585#430310\1\3\2"),
    ),
    Defect("EMCY inhibit time in us", ("EM-08",), acts_as("1015:00", lambda us: us // 100)),
    # error behaviour, store, LSS
    Defect(
        "1029h = 2 is Pre-operational",
        ("HB-14",),
        acts_as("1029:01", lambda value: 0 if value == 2 else value),
        needs=frozenset({"1029"}),
    ),
    Defect(
        "1029h = 1 is Stopped",
        ("HB-13",),
        acts_as("1029:01", lambda value: 2 if value == 1 else value),
        needs=frozenset({"1029"}),
    ),
    Defect(
        "a full history changes at its top alone", ("EM-16",), services={EmcyProducer: AtTheTop}
    ),
    Defect(
        "store by a signature read backwards",
        ("ST-02",),
        hears("605#2310100165766173", "605#2310100173617665"),
    ),
    Defect(
        "restore by a signature read backwards",
        ("ST-06",),
        hears("605#2311100164616F6C", "605#231110016C6F6164"),
    ),
    Defect(
        "1011h says that it cannot restore",
        ("ST-08",),
        says("585#43111001.*", "585#4311100100000000"),
        left=True,
    ),
    Defect(
        "reset communication loads no stored RPDO type", ("NMT-21",), loses(range(0x1400, 0x1600))
    ),
    Defect(
        "reset communication loads no stored mapping", ("NMT-21",), loses(range(0x1A00, 0x1C00))
    ),
    Defect("reset communication loads nothing stored", ("NMT-21",), loses(range(0x1000, 0x1C00))),
    Defect("LSS tells another revision", ("LS-02",), says("7E4#5C(..)(.*)", r"7E4#5C77\2")),
    Defect("LSS tells node-ID 0", ("LS-01",), says("7E4#5E05(.*)", r"7E4#5E00\1")),
    Defect("LSS does not go back to waiting", ("LS-20",), hears("7E5#0400.*")),
    Defect(
        "LSS is configured in waiting",
        ("LS-21",),
        hears("7E5#11(.*)", "7E5#0401000000000000", r"7E5#11\1"),
    ),
    Defect(
        "LSS selective takes any vendor", ("LS-22",), hears("7E5#40.{8}(.*)", r"7E5#4001AB0000\1")
    ),
    Defect(
        "LSS selective takes any product", ("LS-22",), hears("7E5#41.{8}(.*)", r"7E5#4102000000\1")
    ),
)
