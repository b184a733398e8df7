"""Find faults on a bus with all rules that need no parameter.

>>> from tickrig.host.canmon.model.frames import Record
>>> from tickrig.wire.can import CanFrame
>>> frames = [Record(at * 100_000, "can0", CanFrame.parse("705#05")) for at in range(20)]
>>> diagnoser = Diagnoser()
>>> diagnoser.take(frames[:9] + frames[10:])
>>> [str(fault) for fault in diagnoser.diagnosis().faults]
['no-lost-heartbeat: can0 node 5: no heartbeat for 200.000 ms, one each 100.000 before']
"""

# Theory of operation
# ===================
#
# The checker (checker.py) checks each frame against given rules. The diagnosis has no given rules:
# it learns from the log itself what is usual, so it keeps all frames (35 bytes each) and judges
# them at the end. A bus is judged in four steps:
#
# 1. Times. A single time that is out of order is a finding and is replaced by that of its
#    neighbour; a clock that was set back cuts the log in two.
# 2. Is it CANopen (`is_canopen`)? If not, only properties of every bus are judged: error frames,
#    times, load. The meaning of identifiers of other protocols is unknown.
# 3. Services (node_events.py): NMT, error control, EMCY and SDO frames, one by one, decoded as
#    everywhere; of a client that polls a node the first and the last exchange of a row where numpy
#    finds them (`exchanges`). They also give the *cuts*: times at which the rhythm changes on
#    purpose, such as an NMT command or a write to 1800h. No rhythm is judged across a cut, but a
#    boot-up without an NMT reset ends a silence: the frames are missing from the last one on.
# 4. Rhythms (cycles.py): all frames of an identifier at once, heartbeats, SYNC and PDOs; with
#    numpy where a log is large. If a whole bus is silent, that is one finding, and not one for each
#    identifier.
#
# A finding (`Hit`) has rows; hits of one rule, bus and node (or CAN-ID if no node is known) are one
# `BusFault`.

from __future__ import annotations

from bisect import bisect_left, bisect_right
from collections import Counter, deque
from collections.abc import Collection, Iterable, Mapping, Sequence
from itertools import chain, islice, pairwise
from operator import attrgetter
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Final, NamedTuple

from tickrig._lazy import LazyModule
from tickrig.host.canmon.model.check import cycles, learnt, node_events
from tickrig.host.canmon.model.check.bus_frames import (
    BusFrames,
    FrameKeeper,
    FramePlace,
    Hit,
    steady_times,
)
from tickrig.host.canmon.model.check.rule import ONE_TIME
from tickrig.host.canmon.model.decode import node_memory
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.frames import ERROR, FD, REMOTE, Record, ident_text, ms_text, node_of
from tickrig.host.text.values import counted
from tickrig.wire.can import STANDARD_MAX, CanFrame, frame_bits
from tickrig.wire.canopen import nmt, sdo_frame

if TYPE_CHECKING:
    import numpy as np

    from tickrig.host.canmon.model.columns import column_meanings, column_traffic
    from tickrig.host.canmon.model.columns.columns import Columns
else:  # an extra
    np = LazyModule("numpy")
    column_meanings = LazyModule("tickrig.host.canmon.model.columns.column_meanings")
    column_traffic = LazyModule("tickrig.host.canmon.model.columns.column_traffic")

_NO_LOSS: Final = "no-loss"

RULES: Final[Mapping[str, str]] = MappingProxyType(
    {
        **node_events.RULES,
        "no-lost-heartbeat": "a missing heartbeat",
        "length": "a frame of a service with an invalid length",
        "pdo-length": "a PDO whose length changes",
        "pdo-period": "a PDO whose period changes",
        "pdo-jitter": "a PDO whose jitter changes",
        "pdo-missing": "a missing PDO",
        "pdo-doubled": "a PDO that is sent twice",
        "sync-missing": "a missing SYNC",
        "sync-doubled": "a SYNC that is sent twice",
        "sync-period": "a SYNC whose period or jitter changes",
        "drive-fault": "a drive in fault (statusword of CiA 402)",
        "seen-once": "a CAN-ID that appears once",
        "silence": "a silent bus",
        "time-back": "a time that goes back",
        _NO_LOSS: "frames that were lost",
        **learnt.RULES,
        "max-load": "half a second with a load above 80 %",
    }
)
"""Descriptions of all rules by name."""

_MOST_LOAD: Final = 80.0
_ANY_BUS: Final = frozenset(["no-error-frames", "time-back", "max-load"])
_TIMED: Final = (
    *("time-back", "max-load", "silence", "no-lost-heartbeat", "seen-once"),
    *(f"pdo-{what}" for what in ("period", "jitter", "missing", "doubled")),
    *(f"sync-{what}" for what in ("missing", "doubled", "period")),
)
"""Rules that a log without times cannot violate."""
_LENGTHS: Final[Sequence[tuple[Collection[int], tuple[int, ...]]]] = (
    ((nmt.NMT_COB_ID,), (2,)),
    ((node_events.SYNC_ID,), (0, 1)),
    ((node_events.TIME_ID,), (6,)),
    (node_events.EMCY_IDS, (8,)),
    (node_events.RESPONSE_IDS, (sdo_frame.FRAME_BYTES,)),
    (node_events.REQUEST_IDS, (sdo_frame.FRAME_BYTES,)),
    (node_events.ERROR_CONTROL_IDS, (1,)),
)
"""Valid numbers of data bytes of services, by CAN-ID."""
_SURE_SHARE: Final = 0.9
"""Share of gaps with a period from which this period can be learnt."""
_NEAR_US: Final = 100_000
_KEPT_TEXTS: Final = 3
_LOST_AFTER: Final = 1.5
"""Number of periods after which a heartbeat is lost, as on the node board."""
_MOST_STATES: Final = 64
"""Number of values of a statusword above which an object is no statusword."""
_LOAD_US: Final = 500_000
_LOAD_STEP_US: Final = 50_000
_STOPS: Final = 2
"""Number of periods without a TPDO before a boot-up of its node that mean that it is missing."""
_STOPPED: Final = 5
_STOPPED_US: Final = 250_000
"""Number of periods, and duration, without frames at the end of a log that mean a stop."""
_SURE_FRAMES: Final = 50
_LONG_US: Final = 1_000_000
_LEAST_FRAMES: Final = 100
_SOON_US: Final = 1_500_000
"""Time after a boot-up or NMT command in which a single frame belongs to the start."""
_NO_BUS: Final = "nothing was learnt of this bus"
_NO_NODES: Final[Mapping[int, node_memory.EdsObjects]] = MappingProxyType({})


class BusFault(NamedTuple):
    """A fault on a bus, which combines all violations of one rule by one node or CAN-ID.

    Attributes:
        rule: name of the violated rule, a key of `RULES`.
        channel: name of the bus, empty if the fault concerns the whole source.
        node: node-ID of the node that caused the fault, or None if no single node did.
        ident: CAN-ID of the first violation with its flags, as in `BusFrames.ident`, or None if the
            fault concerns the whole bus.
        text: description of the fault.
        first_us: time of the first violation in microseconds.
        last_us: time of the last violation in microseconds.
        amount: number of violations.
        frames: numbers and times of the frames that show the fault, at most the first thousand.
    """

    rule: str
    channel: str
    node: int | None
    ident: int | None
    text: str
    first_us: int
    last_us: int
    amount: int
    frames: tuple[FramePlace, ...]

    @property
    def where(self) -> str:
        """The bus, and the node or CAN-ID of the fault."""
        if self.node is not None:
            return f"{self.channel} node {self.node}"
        return self.channel if self.ident is None else f"{self.channel} {ident_text(self.ident)}"

    def __str__(self) -> str:
        """Return rule, place and text of the fault."""
        where = f"{self.where}: " if self.where else ""
        return f"{self.rule}: {where}{self.text}"


class Diagnosis(NamedTuple):
    """The result of a diagnosis of a log or bus: the faults, and which rules could be judged.

    Attributes:
        faults: faults in the order of their first violation.
        judged: names of the rules that could be judged.
        unjudged: reason why a rule could not be judged, by name of the rule.
        frames: number of frames in the traffic.
    """

    faults: tuple[BusFault, ...]
    judged: tuple[str, ...]
    unjudged: Mapping[str, str]
    frames: int


class Diagnoser:
    """Collector that stores all frames of a log or bus, and then finds the faults in them.

    `canmon check` and `canmon report` use this class. Its rules need no parameters from the user.

    Args:
        bit_rate: bit rate in bits per second, from which the bus load is calculated, or None if
            unknown.
        eds: objects and values from EDS files, by node-ID.
        without_errors: reason why the source cannot contain error frames, empty if it can.
        rules: rules that were learnt from a good log, or None if there are none.

    Attributes:
        kept: storage with all frames added so far.
    """

    def __init__(
        self,
        bit_rate: int | None = None,
        eds: Mapping[int, node_memory.EdsObjects] = _NO_NODES,
        without_errors: str = "",
        rules: learnt.Learnt | None = None,
    ) -> None:
        self._rules = rules
        self._bit_rate, self._eds, self.without_errors = bit_rate, eds, without_errors
        self.kept = FrameKeeper()

    def take(self, frames: Columns | Iterable[Record]) -> None:
        """Store more frames. Call this method for all frames in the order of the log.

        Args:
            frames: the frames, as a block of columns or as records.
        """
        self.kept.take(frames)

    def diagnosis(
        self, lost: Iterable[str] = (), errors: Iterable[str] = (), end_us: int = 0
    ) -> Diagnosis:
        """Judge all frames stored so far by all rules, and return the faults.

        Args:
            lost: messages of the source about lost frames. Each becomes a fault.
            errors: messages of the source about bus errors that it did not report as error frames.
                Each becomes a fault.
            end_us: end of the traffic in microseconds, on the clock of the frames, or 0 for the
                time of the last frame.
        """
        faults: list[BusFault] = []
        judged: set[str] = set()
        why: dict[str, str] = {}
        for bus in self.kept:
            known = learnt.bus_of(self._rules or {}, bus.name, len(self.kept.buses))
            one = _BusJudge(bus, self._bit_rate, self._eds, known, end_us)
            faults += one.faults()
            judged |= one.judged
            why |= one.unjudged
        for rule, texts in ((_NO_LOSS, lost), ("no-error-frames", errors)):
            begin_us = min((bus.at_us[0] for bus in self.kept), default=0)
            faults += [
                BusFault(rule, "", None, None, text, begin_us, begin_us, 1, ()) for text in texts
            ]
        judged |= {_NO_LOSS} if self.kept.frames else set()
        if self.without_errors and "no-error-frames" not in {fault.rule for fault in faults}:
            judged.discard("no-error-frames")
            why["no-error-frames"] = self.without_errors
        if not self.kept.frames:
            why = dict.fromkeys(RULES, "no frame came")
        faults.sort(key=lambda fault: (fault.first_us, fault.frames[:1], fault.channel, fault.rule))
        names = tuple(name for name in RULES if name in judged)
        held = RULES if self._rules is not None else RULES.keys() - learnt.RULES.keys()
        unjudged = {
            name: why.get(name, _NO_BUS) for name in RULES if name in held and name not in judged
        }
        return Diagnosis(tuple(faults), names, unjudged, self.kept.frames)

    def summaries(self) -> list[learnt.BusSummary]:
        """Return a summary of the traffic on each bus."""
        found = []
        for bus in self.kept:
            one = _BusJudge(bus, self._bit_rate, self._eds)
            one.faults()
            found.append(one.summary())
        return found


class _BusJudge:
    """Judge of one bus."""

    def __init__(
        self,
        bus: BusFrames,
        bit_rate: int | None,
        eds: Mapping[int, node_memory.EdsObjects],
        rules: learnt.LearntBus | None = None,
        end_us: int = 0,
    ) -> None:
        self._bus, self._bit_rate, self._eds, self._rules = bus, bit_rate, eds, rules
        self.judged = {"no-error-frames", "time-back"}
        self.unjudged: dict[str, str] = {}
        self._hits: list[Hit] = []
        self._cuts: list[node_events.Cut] = []
        self._rows = bus.rows_by_ident()
        self._backward = bus.backward()
        self._times, self._set_back = steady_times(bus, self._backward)
        # A clock that was set back leaves the end of the log before other times in it.
        last_us = bus.latest(self._times, self._set_back[-1] if self._set_back else 0)
        self._end_us = max(last_us, end_us)

    def faults(self) -> list[BusFault]:
        """Return the faults on the bus."""
        bus, rows = self._bus, self._rows
        self._time()
        self._load()
        self._canopen = canopen = node_events.is_canopen(bus, rows)
        events = self._walk(self._polled() if canopen and bus.is_large else None)
        if self._decoder.bus(bus.name).sdo_moved and bus.is_large:
            events = self._walk(None)
        decoder, self._events = self._decoder, events
        if not canopen:
            why = dict.fromkeys(RULES.keys() - _ANY_BUS, "no CANopen traffic was found")
            self.unjudged = why | self.unjudged
            return self._grouped(events.hits)
        events.end(self._end_us)
        self._cuts = sorted(events.cuts)
        self.unjudged = self._without() | self.unjudged
        self.judged |= RULES.keys() - learnt.RULES.keys() - _ANY_BUS - self.unjudged.keys()
        self._lengths(decoder)
        if "time-back" not in self.unjudged:
            self._rhythms()
        if not self._drives(decoder):
            self.judged.discard("drive-fault")
            self.unjudged["drive-fault"] = "no statusword of CiA 402 came"
        self._once()
        return self._grouped(events.hits)

    def _walk(self, but: Any) -> node_events.BusEvents:
        """Examine the frames of services one by one. `but` is an array of rows to leave out."""
        self._decoder = Decoder(self._eds)
        events = node_events.BusEvents(self._bus, self._times, self._decoder, self._rows)
        parts = [
            found
            for ident, found in self._rows.items()
            if (node_events.is_event(ident) if self._canopen else ident & ERROR and ident < FD)
        ]
        rows = chain.from_iterable(map(_plain, parts))
        for row in sorted(rows) if but is None else _rows_but(parts, but):
            events.take(int(row))
        return events

    def _polled(self) -> Any:
        """Return the rows of SDO exchanges that add no information to their neighbours."""
        bus = self._bus
        rows: Any = column_meanings.of_sdo(np.frombuffer(bus.ident, np.uint64))
        ident: Any = bus.picked(bus.ident, rows)
        dlc: Any = bus.picked(bus.dlc, rows)
        words: Any = bus.picked(bus.payload, rows)
        blocks = column_meanings.block_nodes(ident, words)
        found = column_meanings.exchanges(ident, dlc, words, blocks)
        return rows[np.concatenate((found.requests[found.inner], found.answers[found.inner]))]

    def _without(self) -> dict[str, str]:
        """Return the reasons why rules have nothing to judge."""
        heard, nodes = self._rows.keys(), self._events.nodes.values()
        have = {
            "pdo-": ("no PDO came", any(ident in node_events.PDO_IDS for ident in heard)),
            "sync-": ("no SYNC came", node_events.SYNC_ID in heard),
            "sdo-": ("no SDO came", any(ident in node_events.REQUEST_IDS for ident in heard)),
            "guard-": ("no node is guarded", any(one.toggled for one in nodes)),
            "remote-": ("no heartbeats came", any(len(one.heartbeats) > 1 for one in nodes)),
            "no-lost-": ("no heartbeats came", any(len(one.heartbeats) > 2 for one in nodes)),
            "seen-once": ("the log is short", self._is_long()),
        }
        return {
            rule: why
            for start, (why, there) in have.items()
            if not there
            for rule in RULES
            if rule.startswith(start)
        }

    def _is_long(self) -> bool:
        return len(self._bus) >= _LEAST_FRAMES and self._end_us - self._times[0] >= _LONG_US

    def _hit(
        self, rule: str, ident: int | None, text: str, rows: Sequence[int], n: int = 1
    ) -> None:
        node = None if ident is None else node_of(ident)
        self._hits.append(Hit(rule, node, ident, text, tuple(map(int, rows)), n))

    # Rules for any bus

    def _time(self) -> None:
        at_us, rows = self._bus.at_us, self._backward
        if rows:
            most_us = max(at_us[row - 1] - at_us[row] for row in rows)
            text = f"the time goes back by {'up to ' * (len(rows) > 1)}{ms_text(most_us)} ms"
            self._hit("time-back", None, text, rows, len(rows))
        if len(self._bus) > 1 and not rows and at_us[0] == self._bus.latest(at_us):
            self.unjudged |= dict.fromkeys(_TIMED, ONE_TIME)
            self.judged.discard("time-back")

    def _load(self) -> None:
        if "max-load" in self.unjudged:
            return
        if self._bit_rate is None:
            self.unjudged["max-load"] = "no bit rate is known: give -b, as -b 500000"
            return
        first_us = self._times[0]
        if self._end_us - first_us < _LOAD_US:
            self.unjudged["max-load"] = f"the traffic lasts less than {_LOAD_US / 1e6:g} s"
            return
        self.judged.add("max-load")
        most = _MOST_LOAD / 100 * self._bit_rate * _LOAD_US / 1_000_000
        steps = self._bits_by_step(first_us)
        width, total, over_us = _LOAD_US // _LOAD_STEP_US, 0, first_us
        window: deque[int] = deque()
        for step in sorted(steps):
            window.append(step)
            total += steps[step]
            while window[0] <= step - width:
                total -= steps[window.popleft()]
            begin_us = first_us + (step + 1) * _LOAD_STEP_US - _LOAD_US
            if total > most and begin_us >= over_us:
                over_us = begin_us + _LOAD_US
                begin, end = (
                    min(bisect_left(self._times, at), len(self._bus) - 1)
                    for at in (begin_us, over_us)
                )
                percent = total * 100_000_000 / (self._bit_rate * _LOAD_US)
                text = f"load {percent:.1f} % in {_LOAD_US // 1_000} ms, at most {_MOST_LOAD:g} %"
                self._hit("max-load", None, f"{text} is right", [begin, max(begin, end - 1)])

    def _bits_by_step(self, first_us: int) -> dict[int, int]:
        """Return the bits of classic frames in each step of time."""
        bus = self._bus
        if bus.is_large:
            ident = np.frombuffer(bus.ident, np.uint64)
            plain = np.flatnonzero((ident >> np.uint64(33) == 0) & (ident & np.uint64(ERROR) == 0))
            bits = column_traffic.column_bits(
                ident[plain].astype(np.uint32),
                np.frombuffer(bus.dlc, np.uint8)[plain],
                np.frombuffer(bus.payload, np.uint64)[plain],
            )
            times = np.frombuffer(self._times, np.int64)[plain]
            found, places = np.unique((times - first_us) // _LOAD_STEP_US, return_inverse=True)
            sums = np.bincount(places, bits).astype(np.int64).tolist()
            return dict(zip(found.tolist(), sums, strict=True))
        steps: Counter[int] = Counter()
        for row in range(len(bus)):
            frame = bus.frame(row) if bus.ident[row] < FD else None
            if isinstance(frame, CanFrame):
                steps[(self._times[row] - first_us) // _LOAD_STEP_US] += frame_bits(frame)
        return steps

    # Lengths

    def _lengths(self, decoder: Decoder) -> None:
        for ident, rows in self._rows.items():
            if ident > STANDARD_MAX:
                continue
            sizes = _counted(self._bus.picked(self._bus.dlc, rows))
            if ident in node_events.PDO_IDS:
                self._pdo_length(ident, rows, sizes, decoder)
                continue
            fits = next((right for idents, right in _LENGTHS if ident in idents), None)
            if fits is None:
                continue
            for size in sizes.keys() - set(fits):
                wrong = [row for row in rows if self._bus.dlc[row] == size]
                wanted = " or ".join(map(str, fits))
                text = f"{_name(ident)} has {size} B, {wanted} is right"
                self._hit("length", ident, text, wrong, len(wrong))

    def _pdo_length(
        self, ident: int, rows: Sequence[int], sizes: Counter[int], decoder: Decoder
    ) -> None:
        """Find the frames of a PDO whose length differs from that of most frames."""
        usual = sizes.most_common(1)[0][0]
        layout = decoder.bus(self._bus.name).layout(ident)
        if layout and usual < layout.size:
            text = f"{_name(ident)} has {usual} B, {layout.size} are right by its mapping"
            self._hit("pdo-length", ident, text, rows[: learnt.KEPT_FRAMES], sizes[usual])
        if len(sizes) == 1:
            return
        lengths = _plain(self._bus.picked(self._bus.dlc, rows))
        times = self._bus.picked(self._times, rows)
        changes = [at for at in range(1, len(lengths)) if lengths[at] != lengths[at - 1]]
        cuts = self._cuts_of(ident)
        unknown = [
            at
            for at in changes
            if bisect_right(cuts, times[at]) == bisect_left(cuts, times[at - 1])
        ]
        if not unknown:
            return
        if len(sizes) > 3 or (len(unknown) > 6 and sizes[usual] < 0.9 * len(rows)):
            return  # no PDO: its length says something
        odd = [at for at in range(len(lengths)) if lengths[at] != usual]
        seen = sorted(sizes.keys() - {usual})
        text = f"{_name(ident)} has {' or '.join(map(str, seen))} B, {usual} B before and after"
        if len(odd) > 0.3 * len(rows):
            odd = unknown
            text = f"the length of {_name(ident)} changes from {lengths[odd[0] - 1]} to"
            text += f" {lengths[odd[0]]} B"
        shown = [rows[at] for at in odd[: learnt.KEPT_FRAMES]]
        self._hit("pdo-length", ident, text, shown, len(odd))

    # Rhythms

    def _rhythms(self) -> None:
        self._quiet = self._silences()
        self._silent: dict[int, list[int]] = {}
        for ident, rows in sorted(self._rows.items()):
            node = ident & node_events.NODE_MASK
            if ident == node_events.SYNC_ID:
                self._rhythm("sync", ident, rows)
            elif ident in node_events.ERROR_CONTROL_IDS:
                one = self._events.nodes.get(node)
                if one is not None and not one.toggled and one.heartbeats:
                    self._heartbeats(node, one)
            elif ident in node_events.PDO_IDS:
                self._rhythm("pdo", ident, rows)
        for row, idents in sorted(self._silent.items()):
            gap_us = self._times[row + 1] - self._times[row]
            names = counted(len(idents), "CAN-ID")
            text = f"no frame for {ms_text(gap_us)} ms, where {names} should come"
            self._hit("silence", None, text, [row, row + 1])

    def _silences(self) -> list[tuple[int, int, int]]:
        """Return long times without any frame on the bus, and the rows before and after them."""
        times = self._times
        if len(times) < 2:
            return []
        if self._bus.is_large:
            gaps = np.diff(np.frombuffer(times, np.int64))
            limit = max(20_000, 5 * int(np.partition(gaps, len(gaps) // 2)[len(gaps) // 2]))
            found = np.flatnonzero(gaps > limit).tolist()
        else:
            plain = [b - a for a, b in pairwise(times)]
            limit = max(20_000, 5 * sorted(plain)[len(plain) // 2])
            found = [at for at, gap in enumerate(plain) if gap > limit]
        return [(times[at], times[at + 1], at) for at in found]

    def _cuts_of(self, ident: int) -> list[int]:
        node = ident & node_events.NODE_MASK
        known = node in self._events.nodes or node in self._first_nodes()
        cuts = [cut.at_us for cut in self._cuts if cut.node in (0, node) or (node and not known)]
        cuts += [self._times[row] for row in self._set_back]
        return sorted(cuts)

    def _first_nodes(self) -> set[int]:
        return {ident & node_events.NODE_MASK for ident in self._rows if ident <= STANDARD_MAX}

    def _pieces(self, ident: int, rows: Sequence[int]) -> list[Sequence[int]]:
        """Split the rows of an identifier where the rhythm of its frames changes on purpose."""
        time_of = self._times.__getitem__
        places = {bisect_right(rows, cut, key=time_of) for cut in self._cuts_of(ident)}
        ends = sorted({0, len(rows), *places})
        return [rows[begin:end] for begin, end in pairwise(ends)]

    def _rhythm(
        self,
        kind: str,
        ident: int,
        rows: Sequence[int],
    ) -> None:
        name = _name(ident)
        pieces = self._pieces(ident, rows)
        for piece in pieces:
            times = self._bus.picked(self._times, piece)
            rhythm = cycles.rhythm_of(times)
            if rhythm is None:
                continue
            period = rhythm.period_us
            for at, count in rhythm.missing:
                begin, end = int(times[at]), int(times[at + 1])
                if not self._is_silent(ident, begin, end, period):
                    text = f"{name} does not come for {ms_text(end - begin)} ms, its period is"
                    text += f" {ms_text(period)}"
                    self._hit(f"{kind}-missing", ident, text, piece[at : at + 2], count)
            for at in rhythm.extra:
                one, other = (self._bus.payload[int(piece[place])] for place in (at, at - 1))
                if one != other and len(piece) < _SURE_FRAMES:
                    continue  # an event may come in the middle of a period by chance
                text = f"{name} comes {ms_text(int(times[at]) - int(times[at - 1]))} ms after the"
                text += f" one before, its period is {ms_text(period)}"
                self._hit(f"{kind}-doubled", ident, text, [piece[at]])
            for before, behind in pairwise(rhythm.levels):
                text = f"the period of {name} changes from {ms_text(before.period_us)} to"
                text += f" {ms_text(behind.period_us)} ms"
                self._hit(f"{kind}-period", ident, text, [piece[before.end]])
            for begin, end, usual, large in rhythm.noisy:
                text = f"the jitter of {name} changes from {ms_text(usual)} to {ms_text(large)} ms,"
                text += f" its period is {ms_text(period)}"
                shown = piece[begin : min(end, len(piece) - 1) + 1]
                rule = "pdo-jitter" if kind == "pdo" else "sync-period"
                self._hit(rule, ident, text, shown[: learnt.KEPT_FRAMES])
            last_us = int(times[-1])
            if piece is pieces[-1] and self._end_us - last_us > max(
                _STOPPED * rhythm.levels[-1].period_us, _STOPPED_US
            ):
                text = f"{name} stops {ms_text(self._end_us - last_us)} ms before the end, its"
                text += f" period is {ms_text(period)}"
                self._hit(f"{kind}-missing", ident, text, [piece[-1]])
            elif kind == "pdo":
                self._until_boot(ident, piece, rhythm)

    def _until_boot(self, ident: int, piece: Sequence[int], rhythm: cycles.Rhythm) -> None:
        """Find a TPDO that stops because its node boots again without an NMT reset.

        Another event before the boot-up, such as an NMT command, may end the TPDO on purpose.
        """
        node, rows = ident & node_events.NODE_MASK, self._rows[ident]
        one = self._events.nodes.get(node)
        if one is None or (ident >> 7) % 2 == 0:
            return
        last, times = int(piece[-1]), self._times
        at = bisect_right(rows, last)
        end = int(rows[at]) if at < len(rows) else len(self._bus)
        begin = bisect_right(one.beat_events, last, key=_row_of)
        behind = islice(one.beat_events, begin, bisect_left(one.beat_events, end, key=_row_of))
        boot = next((found for found in behind if found.kind == "boot"), None)
        if boot is None:
            return
        last_us, period = int(times[last]), rhythm.levels[-1].period_us
        cuts = self._cuts_of(ident)
        gap_us = min(boot.at_us, *cuts[bisect_right(cuts, last_us) :][:1]) - last_us
        if gap_us > max(_STOPS * period, period + 4 * rhythm.spread_us) and not self._is_silent(
            ident, last_us, last_us + gap_us, period
        ):
            text = f"{_name(ident)} does not come for {ms_text(gap_us)} ms before the boot-up of"
            text += f" its node, its period is {ms_text(period)}"
            shown = [last, boot.row]
            self._hit("pdo-missing", ident, text, shown, max(1, round(gap_us / period) - 1))

    def _is_silent(self, ident: int, begin: int, end: int, period: int) -> bool:
        """Return whether the whole bus is silent in a gap. Record the silence."""
        at = bisect_left(self._quiet, (begin, 0, 0))
        for start, stop, row in self._quiet[max(0, at - 1) : at + 2]:
            inside = min(stop, end) - max(start, begin)
            if inside >= 0.6 * (end - begin - period) and inside > period:
                self._silent.setdefault(row, []).append(ident)
                return True
        return False

    def _heartbeats(self, node: int, one: node_events.NodeEvents) -> None:
        ident = nmt.ERROR_CONTROL_COB_ID + node
        rows = [row for row in one.heartbeats if self._bus.dlc[row] > 0]
        found = node_memory.two_beats([self._times[row] for row in rows])
        if found is not None:  # every second frame keeps the period
            self._double(ident, [rows[at + 1] for at in found.places])
            return
        pieces = self._pieces(ident, rows)
        for piece in pieces:
            times = [self._times[row] for row in piece]
            if not times:
                continue
            rhythm = cycles.rhythm_of(times)
            if rhythm is None:
                period, missing = self._few_beats(node, times)
            else:
                period, missing = rhythm.period_us, rhythm.missing
                self._odd_beats(ident, piece, rhythm)
            if period is None:
                continue
            says = f"one each {ms_text(period)} before"
            for at, n in missing:
                begin, end = times[at], times[at + 1]
                if not self._is_silent(ident, begin, end, period):
                    self._lost(ident, end - begin, says, piece[at : at + 2], n)
            until = _next_beat_event(one, rows, piece[-1])
            if piece is pieces[-1] and self._end_us - times[-1] > _LOST_AFTER * period:
                if until is not None and until.kind == "boot":
                    says += (
                        f"; boot-up after {ms_text(until.at_us - times[-1])} ms, none since then"
                    )
                self._lost(ident, self._end_us - times[-1], says, piece[-1:], 1)
            elif len(times) > 2 and until is not None:
                gap_us = until.at_us - times[-1]
                if gap_us > _LOST_AFTER * period and not self._is_silent(
                    ident, times[-1], until.at_us, period
                ):
                    n = max(1, round(gap_us / period) - 1)
                    self._lost(ident, gap_us, says, [piece[-1], until.row], n)

    def _few_beats(
        self, node: int, times: Sequence[int]
    ) -> tuple[int | None, Sequence[tuple[int, int]]]:
        """Return the period and longer gaps of heartbeats that are too few for a sure period."""
        gaps = sorted(b - a for a, b in pairwise(times))
        eds_ms = self._eds[node].heartbeat_ms if node in self._eds else 0
        period = eds_ms * 1_000 or (gaps[len(gaps) // 2] if len(gaps) >= 2 else 0)
        if not period or (not eds_ms and gaps[0] < period / 2):
            return None, ()
        missing = [
            (at, 1) for at, (a, b) in enumerate(pairwise(times)) if b - a > _LOST_AFTER * period
        ]
        return (period, missing) if len(missing) <= max(1, len(times) // 4) else (None, ())

    def _odd_beats(self, ident: int, piece: Sequence[int], rhythm: cycles.Rhythm) -> None:
        if len(rhythm.extra) > 2:
            self._double(ident, [piece[at] for at in rhythm.extra])
        for before, behind in pairwise(rhythm.levels):
            text = f"the period of its heartbeat changes from {ms_text(before.period_us)}"
            text += f" to {ms_text(behind.period_us)} ms"
            self._hit("no-lost-heartbeat", ident, text, [piece[before.end]])

    def _lost(self, ident: int, gap: int, says: str, rows: Sequence[int], n: int) -> None:
        text = f"no heartbeat for {ms_text(gap)} ms, {says}"
        self._hit("no-lost-heartbeat", ident, text, rows, n)

    def _double(self, ident: int, rows: Sequence[int]) -> None:
        text = "a second heartbeat comes beside the first: two nodes have this node-ID"
        self._hit("doubled-node", ident, text, rows[: learnt.KEPT_FRAMES], len(rows))

    # Drives, and what comes once

    def _drives(self, decoder: Decoder) -> int:
        """Find the fault bit of statuswords, by the mapping or in a similar TPDO1.

        Returns:
            The number of PDOs with a statusword.
        """
        drives = 0
        for ident, rows in sorted(self._rows.items()):
            if ident not in node_events.PDO_IDS:
                continue
            layout = decoder.bus(self._bus.name).layout(ident)
            shift = None
            if layout and layout.fields:
                if not layout.kind.startswith("tpdo"):
                    continue
                words = [one for one in layout.fields if one.name == "statusword"]
                shift = words[0].shift if words and words[0].shift <= 48 else None
                if shift is None:
                    continue
            elif ident & ~node_events.NODE_MASK != 0x180:
                continue
            drives += self._statusword(ident, rows, shift)
        return drives

    def _statusword(self, ident: int, rows: Sequence[int], shift: int | None) -> bool:
        """Judge a statusword. Return whether the object is a statusword."""
        payload = self._bus.picked(self._bus.payload, rows)
        low, runs = shift or 0, []
        if isinstance(payload, list):
            words = [one >> low & 0xFFFF for one in payload]
            runs = [0, *(at for at in range(1, len(words)) if words[at] != words[at - 1])]
            values = [words[at] for at in runs]
        else:
            table = (np.asarray(payload) >> np.uint64(low)).astype(np.uint16)
            if shift is None and np.count_nonzero(np.bincount(table)) > _MOST_STATES:
                return False  # sooner than `_is_statusword`
            runs = [0, *(np.flatnonzero(table[1:] != table[:-1]) + 1).tolist()]
            values = table[runs].tolist()
        if shift is None and not self._is_statusword(ident, rows, values):
            return False
        before = False
        for at, value in zip(runs, values, strict=True):
            fault = bool(value & node_events.FAULT)
            if fault and not before:
                said = node_memory.drive_state(value)
                text = f"the drive is in fault: statusword {value:04X}h {said}"
                self._hit("drive-fault", ident, text, [rows[at]])
            before = fault
        return True

    def _is_statusword(self, ident: int, rows: Sequence[int], values: Sequence[int]) -> bool:
        """Return whether TPDO1 begins with a statusword.

        All values are states, and one state is enabled.
        """
        if any(self._bus.dlc[row] < 2 for row in rows[: learnt.KEPT_FRAMES]):
            return False
        if len(set(values)) > _MOST_STATES:
            return False
        states = {value & 0x6F for value in values}
        enabled = {0x21, 0x23, 0x27}
        usual = {0x00, 0x20, 0x40, 0x60, 0x07, 0x0F, 0x2F, 0x08, 0x28, *enabled}
        # Bit 4, voltage enabled, and bit 9, remote: one of them is set by every drive that runs.
        running = {value & 0x210 for value in values if value & 0x6F in enabled}
        return states <= usual and bool(running) and 0 not in running

    def _once(self) -> None:
        """Find identifiers with a single frame that no known event explains."""
        times = self._times
        if not self._is_long():
            return
        starts = [cut.at_us for cut in self._cuts]
        heard = set(self._events.nodes)
        for ident, rows in sorted(self._rows.items()):
            if len(rows) != 1 or ident & (ERROR | REMOTE) or ident >= FD:
                continue
            if node_events.is_event(ident) or ident in (*node_events.LSS_IDS, node_events.TIME_ID):
                continue
            at_us = times[rows[0]]
            node = node_of(ident)
            at = bisect_right(starts, at_us)
            started = at > 0 and at_us - starts[at - 1] < _SOON_US
            if ident in node_events.PDO_IDS and node in heard and started:
                continue
            node, name = (node, _name(ident)) if node in heard else (None, ident_text(ident))
            self._hits.append(Hit("seen-once", node, ident, f"{name} comes once", tuple(rows)))

    # The usual traffic

    def summary(self) -> learnt.BusSummary:
        """Return a summary of the traffic on the bus. Call `faults` first."""
        bus, frames = self._bus, {}
        sync = self._rhythm_of(node_events.SYNC_ID)
        for ident, rows in self._rows.items():
            if ident & ERROR and ident < FD:
                continue
            lengths = tuple(sorted(set(_plain(bus.picked(bus.dlc, rows)))))
            long = [
                piece for piece in self._pieces(ident, rows) if len(piece) > 2 * cycles.LEAST_GAPS
            ]
            frame = learnt.FrameSummary(ident, _name(ident), rows, long, lengths)
            rhythm = self._rhythm_of(ident) if _has_rhythm(ident) else None
            frame = frame._replace(irregular=rhythm is None, service=node_events.is_event(ident))
            if rhythm is not None and rhythm.share >= _SURE_SHARE:
                period = rhythm.period_us
                times = sync.period_us if sync and ident != node_events.SYNC_ID else 0
                on_sync = bool(times) and abs(period / times - round(period / times)) < 0.02
                kind = learnt.ON_SYNC if on_sync and ident in node_events.PDO_IDS else learnt.CYCLIC
                frame = frame._replace(kind=kind, period_us=period, jitter_us=rhythm.spread_us)
            frames[ident] = frame._replace(few=not long)
        boots = {node: one.boots[0] for node, one in self._events.nodes.items() if one.boots}
        return learnt.BusSummary(
            *(bus.name, frames, self._node_summaries(), self._boot_order(boots), boots),
            *self._peak(),
            tuple(dict.fromkeys(map(learnt.usual_text, self._hits))),
        )

    def _longest(self, ident: int) -> Sequence[int]:
        """Return the longest series of frames of an identifier without a change of the rhythm."""
        return max(self._pieces(ident, self._rows.get(ident, [])), key=len, default=[])

    def _rhythm_of(self, ident: int) -> cycles.Rhythm | None:
        piece = self._longest(ident)
        return cycles.rhythm_of(self._bus.picked(self._times, piece)) if len(piece) else None

    def _node_summaries(self) -> dict[int, learnt.NodeSummary]:
        nodes, memory = {}, self._decoder.memory
        heard = node_events.first_rows(self._rows) if self._canopen else {}
        for node, row in sorted(heard.items()):
            words = tuple(
                memory(self._bus.name, node).number(node_events.IDENTITY, sub)
                for sub in range(1, len(learnt.IDENTITY) + 1)
            )
            codes = tuple(sorted(self._events.nodes[node].emcy))
            answers = {sub: row for sub, (_, row) in self._events.nodes[node].identity.items()}
            nodes[node] = learnt.NodeSummary(row, words, codes, answers)
        return nodes

    def _boot_order(self, boots: Mapping[int, int]) -> list[list[int]]:
        """Return the nodes in the order of their boot-ups.

        Nodes that boot at nearly one time are a group.
        """
        groups: list[list[int]] = []
        latest_us = None
        for node, row in sorted(boots.items(), key=lambda item: item[1]):
            near = latest_us is not None and self._times[row] - latest_us <= _NEAR_US
            groups[-1:] = [[*groups[-1], node]] if near else [*groups[-1:], [node]]
            latest_us = self._times[row]
        return [sorted(group) for group in groups]

    def _peak(self) -> tuple[int, tuple[int, int]]:
        """Return bits per second of the busiest half second, and the rows of a half second.

        A shorter recording is taken by its own time.
        The rows are the ends of the first half second above the limit, or else of the busiest one.
        """
        first_us, width = self._times[0], _LOAD_US // _LOAD_STEP_US
        steps = self._bits_by_step(first_us)
        sums = {at: sum(steps.get(at + off, 0) for off in range(width)) for at in steps}
        busiest = max(sums, key=lambda at: (sums[at], -at), default=0)
        most = self._rules.bits_per_second if self._rules else None
        span_us = min(_LOAD_US, max(_LOAD_STEP_US, self._end_us - first_us))
        limit = (most or 0) * span_us / 1_000_000
        shown = min((at for at in sums if most and sums[at] > limit), default=busiest)
        begin_us = first_us + shown * _LOAD_STEP_US
        begin, end = (bisect_left(self._times, at) for at in (begin_us, begin_us + _LOAD_US))
        begin = min(begin, len(self._times) - 1)
        return sums.get(busiest, 0) * 1_000_000 // span_us, (begin, max(begin, end - 1))

    def _grouped(self, hits: Iterable[Hit]) -> list[BusFault]:
        """Combine the hits of one rule about one node or CAN-ID."""
        self._hits += hits
        if self._rules is not None:
            self.judged |= learnt.RULES.keys()
            self._hits += learnt.broken(self._rules, self.summary(), self._bus, self._times)
            self._hits = [hit for hit in self._hits if not self._rules.is_usual(hit)]
        groups: dict[tuple[str, int | None], list[Hit]] = {}
        for hit in self._hits:
            key = hit.node if hit.node is not None else -1 if hit.ident is None else ~hit.ident
            groups.setdefault((hit.rule, key), []).append(hit)
        return [self._fault(group) for group in groups.values()]

    def _fault(self, hits: Sequence[Hit]) -> BusFault:
        hits = sorted(hits, key=lambda hit: hit.rows[0])
        first = hits[0]
        texts = list(dict.fromkeys(hit.text for hit in hits))
        text = "; ".join(texts[:_KEPT_TEXTS])
        if len(texts) > _KEPT_TEXTS:
            text += f"; and {len(texts) - _KEPT_TEXTS} more"
        rows = sorted({row for hit in hits for row in hit.rows})
        times = [self._bus.at_us[row] for row in rows]
        return BusFault(
            *(first.rule, self._bus.name, first.node, first.ident, text, min(times), max(times)),
            sum(hit.amount for hit in hits),
            tuple(self._bus.place(row) for row in rows[: learnt.KEPT_FRAMES]),
        )


_row_of: Final = attrgetter("row")


def _next_beat_event(
    one: node_events.NodeEvents, heartbeats: Sequence[int], last: int
) -> node_events.BeatEvent | None:
    """Return the event before the next heartbeat up to which a node should have sent heartbeats."""
    at = bisect_right(heartbeats, last)
    end = heartbeats[at] if at < len(heartbeats) else None
    place = bisect_right(one.beat_events, last, key=_row_of)
    found = one.beat_events[place] if place < len(one.beat_events) else None
    if found is None or found.kind == "excuse" or (end is not None and found.row > end):
        return None
    return found


def _rows_but(parts: Iterable[Any], but: Any) -> Any:
    """Return the rows of all parts, sorted, as an array; the rows `but` are left out."""
    return np.setdiff1d(np.concatenate((np.empty(0, np.int64), *parts)), but)


def _counted(values: Any) -> Counter[int]:
    """Count values of at most 8 bits, in the order in which they appear."""
    if isinstance(values, list):
        return Counter(values)
    counts = np.bincount(values)
    sizes = np.flatnonzero(counts).tolist()
    if len(sizes) > 1:
        sizes.sort(key=lambda size: int(np.argmax(values == size)))
    return Counter({size: int(counts[size]) for size in sizes})


def _plain(values: Any) -> list[int]:
    """Return the values as a list of Python integers."""
    if isinstance(values, list):
        return values
    found: list[int] = values.tolist() if hasattr(values, "tolist") else list(values)
    return found


def _has_rhythm(ident: int) -> bool:
    once = ident in (node_events.SYNC_ID, node_events.TIME_ID)
    return once or ident in node_events.PDO_IDS or ident in node_events.ERROR_CONTROL_IDS


def _name(ident: int) -> str:
    """Name an identifier by the pre-defined connection set."""
    shown = ident_text(ident)
    if ident == node_events.SYNC_ID:
        return "SYNC"
    if ident in node_events.PDO_IDS:
        block = (ident - 0x180) >> 7
        return f"{'RPDO' if block % 2 else 'TPDO'}{block // 2 + 1} ({shown})"
    names = {
        0x000: "NMT",
        0x080: "EMCY",
        0x100: "TIME",
        0x580: "SDO response",
        0x600: "SDO request",
        0x700: "error control",
    }
    name = names.get(ident & ~node_events.NODE_MASK) if ident <= STANDARD_MAX else None
    return f"{name} ({shown})" if name else shown
