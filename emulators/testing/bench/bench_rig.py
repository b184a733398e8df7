"""All devices of a bench on one rig, with their operator and a journal."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from operator import attrgetter
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tickrig._lazy import LazyModule
from tickrig.device.physical import InputSignal, OutputSignal, SignalType
from tickrig.device.twin import Copyable
from tickrig.emulators.bench.operator import Assembly, AssemblyFaults, FaultOrder, Operator
from tickrig.emulators.bench.running_emulator import RunningEmulator
from tickrig.emulators.canopen import late
from tickrig.emulators.record.frames import FrameFormat, hex_text
from tickrig.emulators.record.recorder import TraceRecorder
from tickrig.emulators.record.wire_log import Splitter, WireLine, WireLog
from tickrig.emulators.rig.clock import Clock
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.emulators.rig.faults import FaultForm, FaultyPort, near_fault, usage
from tickrig.emulators.rig.port import OutsideBridge
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.testing.bench.errors import NotOnThisBench
from tickrig.emulators.testing.bench.mounts import BusMount, LineMount, Mount
from tickrig.host.text import notebook
from tickrig.host.text.bench_header import BenchHeader
from tickrig.host.text.byte_text import escape
from tickrig.host.text.names import near
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import Setting, format_time
from tickrig.wire.can import CanFrame, ErrorFrame, Frames
from tickrig.wire.instant import NEVER

if TYPE_CHECKING:
    from tickrig.emulators.can.faults import CanFaults
    from tickrig.emulators.canopen.body import BodyOnDrives
    from tickrig.emulators.canopen.store_file import StoreFile
    from tickrig.emulators.serial.network import NetworkPort
    from tickrig.emulators.serial.pty_port import PtyPort
    from tickrig.emulators.testing.signals import driver
    from tickrig.emulators.testing.signals.sources import SignalSpec
else:  # only a bench with signals needs it
    driver = LazyModule("tickrig.emulators.testing.signals.driver")


# Journal of a bench: lines and frames of all wires, and actions on the devices.

_KEPT: Final = 10_000
"""Number of lines kept; earlier lines are only counted."""

_MAPPINGS_KEPT: Final = 4_000
"""Number of additional frames kept that define the contents of PDOs."""

_SDO_IDS: Final = range(0x581, 0x680)
_ERROR_CONTROL_IDS: Final = range(0x701, 0x780)
_PDO_OBJECTS: Final = range(0x1400, 0x1C00)
"""Indices of objects that define the contents of PDOs; a boot-up resets these objects."""

_ENDS: Final = (b"host", b"device")


class Journal(WireLog):
    """Log of a bench: the latest lines, frames and actions on all wires, in order of time.

    A line of text is recorded when the device has received or sent the last byte of the line. On a
    serial line, the recorded bytes are those that the host has sent or received. If a fault on the
    way to or from the device has changed data, a further entry with the mark `~` shows the data as
    sent and as received.
    """

    def __init__(self) -> None:
        super().__init__(_KEPT)
        self._logs: list[tuple[str, WireLog]] = []
        self._mappings: deque[WireLine] = deque(maxlen=_MAPPINGS_KEPT)

    def of_line(
        self, source: str, splitter: Callable[[Mark], Splitter] | None
    ) -> Callable[[int, Mark, bytes], None]:
        """Return a function that records bytes of a serial line, in any chunks."""
        log = WireLog(0) if splitter is None else WireLog(0, splitter)
        log.listeners.append(lambda line: self.add(line.at_us, line.mark, line.data, source))
        self._logs.append((source, log))
        return log.hear

    def of_faults(
        self,
        source: str,
        ends: tuple[bytes, bytes] = _ENDS,
        splitter: Callable[[Mark], Splitter] | None = None,
    ) -> Callable[[int, Mark, bytes | Frames, bytes | Frames], None]:
        """Return a function that records data before and after a fault has changed them.

        Args:
            source: name of the line or node.
            ends: names of the two sides of the wire, such as `host` and `device`, for the text of
                an entry. The second name is that of the device or node.
            splitter: object that splits the bytes of a serial line into entries of the journal. If
                the format of the entries has no delimiter, the bytes are shown in hex.
        """
        is_binary = isinstance(splitter, FrameFormat) and not splitter.delimiter

        def hear(at_us: int, mark: Mark, sent: bytes | Frames, received: bytes | Frames) -> None:
            if is_binary and isinstance(sent, bytes) and isinstance(received, bytes):
                sent, received = hex_text(sent).encode(), hex_text(received).encode()
            sender, receiver = ends if mark is Mark.TO_DEVICE else ends[::-1]
            words = (
                b"the",
                receiver,
                b"hears",
                _shown(received) or b"nothing",
                b"where the",
                sender,
                b"sent",
            )
            self.add(at_us, Mark.WIRE, b" ".join((*words, _shown(sent))), source)

        return hear

    def of_settings(self, source: str) -> Callable[[int, str], None]:
        """Return a function that records that host and device have different line settings."""

        def hear(at_us: int, text: str) -> None:
            self.add(at_us, Mark.WIRE, text.encode(), source)

        return hear

    def of_lost(self, source: str) -> Callable[[int, CanFrame], None]:
        """Return a function that records frames of a bus that no node receives."""

        def hear(at_us: int, frame: CanFrame) -> None:
            self.add(at_us, Mark.WIRE, f"no node takes {frame}".encode(), source)

        return hear

    def of_bus(self, source: str) -> Callable[[int, CanFrame | ErrorFrame], None]:
        """Return an observer of a CAN bus."""

        def hear(at_us: int, frame: CanFrame | ErrorFrame) -> None:
            self.add(at_us, Mark.FROM_DEVICE, frame, source)
            if isinstance(frame, CanFrame) and _maps(frame):
                data = str(frame).encode()
                line = WireLine(self._count, at_us, Mark.FROM_DEVICE, data, source)
                self._mappings.append(line)

        return hear

    def follow(self, rig: Rig, name: str = "") -> None:
        """Record a frame as soon as the silence that ends it is long enough."""
        for source, log in self._logs:
            log.follow(rig, source)

    def end_silent(self, at_us: int) -> None:
        """Record frames that a silence has ended."""
        super().end_silent(at_us)
        for _, log in self._logs:
            log.end_silent(at_us)

    def unfinished(self, *, by_gap: bool = False) -> tuple[WireLine, ...]:
        """Return the unfinished lines and frames, sorted by the time of their last byte."""
        found = [
            replace(line, source=name)
            for name, log in self._logs
            for line in log.unfinished(by_gap=by_gap)
        ]
        return tuple(sorted(found, key=lambda line: line.at_us))

    def lines(self) -> tuple[WireLine, ...]:
        """Return the kept entries of the journal in order of time.

        On some serial lines a frame ends by a silence. The last frame on such a serial line is
        included, although it may not be complete yet.

        The order of time can differ from the order in which entries were added. For example, an
        action is added at once, but has the time of the next tick of its device.
        """
        begun = enumerate(self.unfinished(by_gap=True), start=self._count + 1)
        lines = (*self.since(0), *(replace(line, number=number) for number, line in begun))
        ordered = sorted(lines, key=attrgetter("at_us"))
        return tuple(
            line if line.number == added.number else replace(line, number=added.number)
            for added, line in zip(lines, ordered, strict=True)
        )

    def mappings(self) -> tuple[WireLine, ...]:
        """Return earlier frames that define the contents of PDOs."""
        first = self._count - _KEPT
        return tuple(line for line in self._mappings if line.number <= first)


def _shown(traffic: bytes | Frames) -> bytes:
    return traffic if isinstance(traffic, bytes) else " ".join(map(str, traffic)).encode()


def _maps(frame: CanFrame) -> bool:
    """Return whether a frame accesses the definition of PDOs, or is a boot-up."""
    if frame.can_id in _SDO_IDS:
        return int.from_bytes(frame.data[1:3], "little") in _PDO_OBJECTS
    return frame.can_id in _ERROR_CONTROL_IDS and frame.data == b"\0"


def text_of(lines: Sequence[WireLine]) -> str:
    """Return the lines of a journal as text.

    If the journal has dropped earlier lines, the first line of the text tells how many.
    """
    written = [line_text(line) for line in lines]
    if missing := missing_of(lines):
        written.insert(0, f"({missing})")
    return "\n".join(written)


def line_text(line: WireLine) -> str:
    """Write a line as text: time in seconds, wire or device, direction, text."""
    return f"{format_time(line.at_us)} {line.source} {line.mark} {escape(line.data)}"


def missing_of(lines: Sequence[WireLine]) -> str:
    """Return a note with the number of earlier lines that a journal no longer has, or ""."""
    before = lines[0].number - 1 if lines else 0
    came = f"{before} {'line' if before == 1 else 'lines'} came before"
    return f"{came}; the last {len(lines)} are kept" if before else ""


class BenchOperator(Operator):
    """Operator of several devices: sets their inputs and starts their faults.

    Args:
        assembly: the inputs and outputs of all devices.
        queue: queue for scheduled actions.
        faults: faults of the wires and nodes.
    """

    def __init__(self, assembly: Assembly, queue: EventQueue, faults: AssemblyFaults) -> None:
        super().__init__(assembly.inputs, assembly.tick_us, queue, faults)
        self._assembly, self._wires = assembly, faults.wires

    def full_name_of(self, name: str) -> str:
        """Return the name under which the bench has a fault.

        Args:
            name: name of the fault: `FAULT`, `DEVICE/FAULT` or `WIRE/FAULT`. If the bench has the
                fault only as `FAULT`, the result is `FAULT`.
        """
        owner, _, bare = name.rpartition("/")
        owned = owner in self._assembly.parts or owner in self._wires
        return bare if owned and name not in self.faults and bare in self.faults else name

    def _tick_us_of(self, name: str) -> int:
        return self._assembly.tick_us_of(name)


@dataclass(frozen=True, slots=True, kw_only=True)
class Parts:
    """Everything from which a bench is made: devices on their wires, initial values and signals.

    Attributes:
        mounts: wires with their devices.
        bodies: mechanical bodies, which are moved by motor drives. The bench also treats each body
            as a device, with the name `body`.
        start: initial values of inputs, by device and name.
        signals: values that change with time. The key `DEVICE/INPUT` is an input, whose value the
            signal sets. A value with any other key sets no input. The formulas of other signals can
            use this key like a variable.
        stores: files for the parameters that nodes store. A file is written when a node stores
            something.
        seed: seed of all random numbers.
    """

    mounts: Sequence[Mount]
    bodies: Sequence[BodyOnDrives] = ()
    start: Mapping[str, Mapping[str, Setting]] = field(default_factory=dict)
    signals: Mapping[str, SignalSpec] = field(default_factory=dict)
    stores: Sequence[StoreFile] = ()
    seed: int = 0

    @property
    def assembly(self) -> Assembly:
        """The physical side of all devices."""
        devices = {name: part for mount in self.mounts for name, part in mount.parts.items()}
        return Assembly({**devices, **{body.name: late.NodeSide(body) for body in self.bodies}})

    @property
    def faults(self) -> AssemblyFaults:
        """The faults of all wires and nodes."""
        buses = [mount for mount in self.mounts if isinstance(mount, BusMount)]
        nodes = {name: one for bus in buses for name, one in bus.node_faults.items()}
        devices = [name for mount in self.mounts for name in mount.parts]
        names = [*devices, *(body.name for body in self.bodies)]
        wires = {mount.name: mount.faults for mount in self.mounts}
        return AssemblyFaults(wires, nodes, names[0] if len(names) == 1 else "")


class RigState(Copyable):
    """The rig of a bench with its wires, devices, faults and recorder.

    A copy of the bench gets a copy of this state.

    Args:
        parts: wires and devices of the bench.
        bridges: connections to hosts outside the process.
        clock: clock of the rig, or None to use a `VirtualClock`.
        trace: file of the recording, or None for no file.
        keeps: whether the run is recorded in memory if there is no file.

    Raises:
        ValueError: an input or signal is invalid.
        OSError: the file cannot be opened.
    """

    def __init__(
        self,
        parts: Parts,
        *,
        bridges: Sequence[OutsideBridge] = (),
        clock: Clock | None = None,
        trace: Path | None = None,
        keeps: bool = True,
    ) -> None:
        mounts = parts.mounts
        self.mounts = {mount.name: mount for mount in mounts}
        self.assembly, self.faults = parts.assembly, parts.faults
        self.recorder = (
            TraceRecorder(trace, _header_of(mounts, parts.seed)) if trace or keeps else None
        )
        self.drivers = self._drivers(parts)
        self.rig = Rig(
            *(station for mount in mounts for station in mount.stations(self.recorder)),
            bridges=bridges,
            couplings=(*parts.bodies, *self.drivers),
            clock=clock,
        )
        self._start(parts.start)  # it is recorded too
        for mount in mounts:
            if isinstance(mount, BusMount):
                self.rig.move_on(mount.wire)
        self.operator = BenchOperator(self.assembly, self.rig.event_queue, self.faults)

    def _start(self, start: Mapping[str, Mapping[str, Setting]]) -> None:
        for device, values in start.items():
            for name, value in values.items():
                self.assembly.parts[device].inputs.set(name, value)

    def _drivers(self, parts: Parts) -> Sequence[driver.SignalDriver]:
        if not parts.signals:
            return ()
        return (driver.SignalDriver(parts.signals, self.assembly.parts, parts.seed),)

    @property
    def chances(self) -> Sequence[FaultyPort[bytes] | CanFaults]:
        """Objects with random faults, in the order of the wires."""
        return [chance for mount in self.mounts.values() for chance in mount.chances]

    def draw_by(self, seed: int) -> None:
        """Give each wire a new, different seed for the random faults that start from now on."""
        for number, chance in enumerate(self.chances):
            chance.seed = seed * len(self.chances) + number

    def full_fault_name(self, owner: str, fault: str) -> str:
        """Return the full name of a fault, which is unique on the bench.

        Args:
            owner: name of a device or wire. For a device, the fault may belong to the device or to
                its wire. If the name is empty, any device and wire is searched.
            fault: short name of the fault.

        Raises:
            ValueError: the fault is unknown.
        """
        faults, hands = self.faults_of(owner), self.operator
        if fault in faults:
            return faults[fault]
        full = hands.full_name_of(fault)
        if full not in hands.faults:
            of_owner = f" of {owner}" if owner else ""
            part = self.assembly.parts.get(owner)
            inputs = (part or self.assembly).inputs.table if part or not owner else ()
            raise ValueError(f"no fault {fault!r}{of_owner}; {near_fault(fault, faults, inputs)}")
        return full

    def faults_of(self, owner: str) -> dict[str, str]:
        """Return the faults of a device and its wire, of a wire alone, or of the whole bench.

        Args:
            owner: name of the device or wire, or empty for the whole bench.

        Returns:
            The faults, as a mapping from short names to full names. A short name is unique for this
            owner, and a full name is unique on the bench.
        """
        everything = self.operator.faults
        if not owner:
            return {name: name for name in everything}
        wire = owner if owner in self.mounts else self.wire_of(owner)
        faults = self.faults.of_wire(wire) | self.faults.of_node(owner)
        if (part := self.assembly.parts.get(owner)) is not None:
            full = self.assembly.full_name
            faults |= {name: full(owner, name) for name in part.inputs.names(SignalType.FAULT)}
        return faults

    def wire_of(self, device: str) -> str:
        """Return the name of the wire of a device; raise ValueError if no such device exists."""
        for mount in self.mounts.values():
            if device in mount.parts:
                return mount.name
        raise ValueError(f"no device {device!r}; {near(device, self.assembly.parts)}")


def _header_of(mounts: Iterable[Mount], seed: int) -> BenchHeader:
    """Return the description of the bench for a trace."""
    entries = {name: entry for mount in mounts for name, entry in mount.entries.items()}
    return BenchHeader(entries, {mount.name: mount.wire_entry for mount in mounts}, seed)


@dataclass(frozen=True, slots=True)
class BenchDescription:
    """Inputs, outputs and faults of one device, or of all devices of a bench, by name.

    Attributes:
        name: name of the device or bench.
        inputs: all inputs, including buttons and physical faults.
        groups: names of the inputs that are set together, by name of their group.
        outputs: all outputs. A signal that is also an input is only in `inputs`.
        faults: physical faults, and faults of the wire.
    """

    name: str
    inputs: Mapping[str, InputSignal]
    groups: Mapping[str, tuple[str, ...]]
    outputs: Mapping[str, OutputSignal]
    faults: Mapping[str, FaultForm]

    @property
    def buttons(self) -> tuple[str, ...]:
        """Names of the buttons."""
        return tuple(n for n, each in self.inputs.items() if each.type is SignalType.BUTTON)

    @property
    def named(self) -> list[str]:
        """Names of inputs and outputs, but not of the many objects of CANopen nodes."""
        names = dict.fromkeys((*self.inputs, *self.outputs))
        return [name for name in names if not name.rpartition("/")[2].startswith(_OBJECT)]

    def _repr_html_(self) -> str:
        """Return tables of inputs, outputs, faults and groups, for Jupyter."""
        return notebook.heading(self.name) + self.tables({})

    def tables(self, values: Mapping[str, object]) -> str:
        """Return HTML tables of the inputs, outputs, faults and groups, for Jupyter.

        Args:
            values: present values by name of the input or output. If it is empty, no values are
                shown.
        """
        named = self.named
        columns = ["name", *["value"] * bool(values), "unit", "what"]
        inputs = (
            (
                one.name,
                *([values.get(name, "")] if values else ()),
                f"{one.type.value} {one.low:g}..{one.high:g} {one.unit}",
                one.text,
            )
            for name in named
            if (one := self.inputs.get(name)) and one.type is not SignalType.FAULT
        )
        outputs = (
            (shown.name, *([values.get(name, "")] if values else ()), shown.unit, shown.text)
            for name in named
            if (shown := self.outputs.get(name))
        )
        faults = ((usage(name, one), one.text) for name, one in self.faults.items())
        groups = ((name, " ".join(members)) for name, members in self.groups.items())
        objects = len({*self.inputs, *self.outputs}) - len(named)
        return "".join(
            (
                notebook.table(columns, outputs, "Outputs", opened=True),
                notebook.table(columns, inputs, "Inputs"),
                notebook.table(("fault", "what"), faults, "Faults"),
                notebook.table(("group", "inputs"), groups, "Groups"),
                f"<p>{objects} objects of CANopen nodes</p>" if objects else "",
            )
        )

    def __str__(self) -> str:
        """Return a readable list, without the many objects of CANopen nodes."""
        inputs = {
            name: f"{one.type.value} {one.low:g}..{one.high:g} {one.unit}".rstrip()
            for name, one in self.inputs.items()
            if one.type is not SignalType.FAULT
        }
        outputs = {name: one.unit for name, one in self.outputs.items()}
        faults = {usage(name, one): "" for name, one in self.faults.items()}
        texts = {usage(name, one): one.text for name, one in self.faults.items()}
        texts |= {name: one.text for name, one in self.inputs.items()}
        texts |= {name: one.text for name, one in self.outputs.items()}
        lines = [self.name]
        for title, shown in (("inputs", inputs), ("outputs", outputs), ("faults", faults)):
            lines.append(title)
            for name, value in shown.items():
                if not name.rpartition("/")[2].startswith("0x"):
                    lines.append(f"  {name:<24} {value:<16} {texts[name]}".rstrip())
        lines += ["groups"] * bool(self.groups)
        lines += [f"  {name:<24} {' '.join(group)}" for name, group in self.groups.items()]
        return "\n".join(lines)


_OBJECT: Final = "0x"
_BUS_AND_NODE: Final = (b"bus", b"node")
"""Labels of the ends of a node's filter."""


class BenchRig(RunningEmulator):
    """The running emulation of a bench: its rig with all devices, their operator and the journal.

    `EmulatorControl` answers requests about this bench.

    Args:
        name: name of the bench.
        state: rig, wires and devices of the bench.
        link: address at which hosts find the bench, as text.

    Attributes:
        state: rig, wires and devices of the bench.
        journal: log of the traffic and the actions.
        orders: faults that a rig file or a test has requested, with their times and conditions.
            Faults that a control socket has requested are not in this list.
        ports: ports of hosts in real time, by name of the line.
    """

    ports: Mapping[str, Sequence[PtyPort | NetworkPort]]

    def __init__(self, name: str, state: RigState, link: str = "") -> None:
        super().__init__(name, state.assembly, state.faults, link, state.recorder)
        self.state, self.rig, self.operator = state, state.rig, state.operator
        self.event_queue = state.rig.event_queue
        self.log = self.journal = Journal()
        self.orders: list[FaultOrder] = []
        self.ports = {}
        self.operator.note = self._note
        for mount in state.mounts.values():
            if isinstance(mount, LineMount):
                hear = self.journal.of_line(mount.name, mount.settings.splitter)
                mount.tap.listeners.append(hear)
                suffer = self.journal.of_faults(mount.name, splitter=mount.settings.splitter)
                mount.faults.listeners.append(suffer)
            else:
                mount.wire.observers.append(self.journal.of_bus(mount.name))
                mount.wire.faults.listeners.append(self.journal.of_lost(mount.name))
                for node, faults in mount.node_faults.items():
                    faults.listeners.append(self.journal.of_faults(node, _BUS_AND_NODE))
        self.journal.follow(self.rig)

    def _note(self, text: str) -> None:
        """Record an action; signals and faults of a single device or wire have no prefix."""
        source, slash, what = text.partition("/")
        fault = text.partition("=")[0]
        of_wire = fault in self.wire.fault_types
        if not slash:
            first = next(iter(self.state.mounts))
            bare = of_wire and fault in self.state.faults.of_wire(first)
            places = self.state.mounts if bare else self.state.assembly.parts
            source, what = next(iter(places)), text
        if of_wire and self.state.recorder:
            self.state.recorder.wire_fault(self.effective_us, source, what)
        self.journal.add(self.effective_us, Mark.PHYSICAL, what.encode(), source)

    def describe(self, owner: str) -> BenchDescription:
        """Return inputs, outputs and faults of a device, or of all devices if `owner` is empty."""
        part: HasSignals = self.device
        if owner:
            part = self.state.assembly.parts[owner]
        types, physical = self.state.faults.fault_types, self.state.assembly.inputs.table
        faults = {
            name: types.get(full) or FaultForm(physical[full].text, rated=False)
            for name, full in self.state.faults_of(owner).items()
        }
        return BenchDescription(
            owner or self.name,
            dict(part.inputs.table),
            dict(part.inputs.groups),
            dict(part.outputs),
            faults,
        )

    def is_ordered(self, order: FaultOrder) -> bool:
        """Return whether a fault was requested, and not cancelled since."""
        return any(each is order for each in self.orders)

    def cancel(self, fault: str) -> None:
        """Cancel a requested fault whose start condition has not become true yet.

        Args:
            fault: full name of the fault.
        """
        self.orders[:] = [
            order for order in self.orders if order.due_us is not None or order.spec.name != fault
        ]

    def drop_unheard(self) -> None:
        """Discard received data of serial lines that no host has read."""
        for mount in self.state.mounts.values():
            if isinstance(mount, LineMount):
                mount.line.b.poll(self.rig.now_us)

    @property
    def settling_us(self) -> int:
        """Duration until the bytes sent by hosts have arrived and each device has had two ticks."""
        now_us = self.rig.now_us
        lines = [one.line for one in self.state.mounts.values() if isinstance(one, LineMount)]
        sent_us = [line.b.sent_us for line in lines if line.b.sent_us < NEVER]
        tick_us = max((station.tick_us for station in self.rig.stations), default=0)
        return max([now_us, *sent_us]) - now_us + 2 * tick_us

    def save_trace(self, path: Path) -> None:
        """Write the recording in memory to a file; raise OSError if that fails."""
        if self.state.recorder is None:
            raise NotOnThisBench("nothing was recorded on this bench")
        self.state.recorder.save(path, self.rig.now_us)

    def send(self, now_us: int, data: bytes) -> None:
        """Send bytes on the line of the only serial device, as the host."""
        lines = [mount for mount in self.state.mounts.values() if isinstance(mount, LineMount)]
        (mount,) = lines
        mount.line.b.send(now_us, data)

    @property
    def lost(self) -> dict[str, int]:
        """Amount of data lost because of full buffers, by wire."""
        return {f"lost_{name}": mount.lost for name, mount in self.state.mounts.items()}
