"""The work of `tickrig compare`: make the two runs of a device or a bus, and print differences."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from itertools import islice
from pathlib import Path
from typing import Any, Final

import click

from tickrig.device.canopen.slave import CanopenSlave
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.build import describe_nodes, make_nodes
from tickrig.emulators.canopen.eds import EdsCache
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.canopen.node_spec import parse_node
from tickrig.emulators.commands.device_type import DEVICES, ConfiguredDevice, configure
from tickrig.emulators.commands.run import mistakes_in
from tickrig.emulators.record import replay
from tickrig.emulators.record.comparison import Pair, Said, Tolerance, compare, parse_number_rule
from tickrig.emulators.record.wire_log import Splitter, WireLine, line_splitter
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.emulator import Emulator
from tickrig.emulators.testing.bench.recorded_device import make_recorded, user_code
from tickrig.host.cli.messages import Refused, refuse_path, refused_at, say, show_findings
from tickrig.host.cli.options import refuse_idle
from tickrig.host.text.bench_record import BenchRecord
from tickrig.host.text.byte_text import escape
from tickrig.host.text.names import near
from tickrig.host.text.trace import Mark
from tickrig.host.text.values import aligned, counted, format_time, parse_setting
from tickrig.wire.can import CanFrame, ErrorFrame
from tickrig.wire.instant import NEVER

# Recorded output of a device on a serial line, and output of an emulator for the same host.

_SEARCHED_US: Final = 10_000_000
"""Time after power-on within which an emulator may send the first recorded line."""

_PHASES: Final = 8
"""Number of tick phases to try, because a port does not show where ticks start."""


@dataclass(frozen=True, slots=True)
class _ComparedRun:
    """Two runs of a device, in the time of the recording.

    Attributes:
        recorded: recorded output.
        emulated: output of the emulator.
    """

    recorded: list[Said]
    emulated: list[Said]


def _compare_ticks(
    recording: replay.BenchRecording, name: str, configured: ConfiguredDevice
) -> _ComparedRun:
    """Replay the recorded ticks on the emulator.

    Args:
        recording: the recording, made at the device.
        name: name of the device.
        configured: a new device.
    """
    split = configured.type.line.splitter or line_splitter
    said = replay.traffic_of(recording.of(name), Mark.FROM_DEVICE)
    played = ((at, data, 0) for at, data in replay.play_device(recording, name, configured.device))
    return _ComparedRun(
        list(_cut(split(Mark.FROM_DEVICE), said)), list(_cut(split(Mark.FROM_DEVICE), played))
    )


def _compare_port(
    recording: replay.BenchRecording,
    name: str,
    make: Callable[[], ConfiguredDevice],
    tolerance: Tolerance,
    settle_us: int,
) -> _ComparedRun:
    """Replay the recorded host on a line with the emulator, at its times.

    Args:
        recording: the recording, made at the port of the host.
        name: name of the device.
        make: function that makes the device.
        tolerance: tolerances. Their time is also the time after the end of the recording in which
            the emulator may still answer.
        settle_us: time for which the emulator is on before the recording starts. If the first
            recorded output is the greeting after power-on, a start at power-on is tried too. If an
            input was set for less than a tick, other tick phases are tried. The closest run counts.
    """
    records, device = recording.of(name), make().device
    until_us = recording.until_us + tolerance.allowed_us(recording.until_us)
    split = make().type.line.splitter or line_splitter
    recorded = list(_cut(split(Mark.FROM_DEVICE), replay.traffic_of(records, Mark.FROM_DEVICE)))

    def run(begin_us: int) -> _ComparedRun:
        emulated = _play(make(), records, begin_us, begin_us + until_us)
        return _ComparedRun(recorded, [x for x in emulated if x.at_us >= -tolerance.time_us])

    phases = _PHASES if _has_short_change(records, device.tick_us) else 1
    begins = [settle_us + device.tick_us * phase // phases for phase in range(phases)]
    if recorded:
        begins += _begin_with(recorded[0], _play(make(), (), 0, _SEARCHED_US), tolerance)
    return _closest(map(run, begins), recording.until_us, tolerance)


def _has_short_change(records: Iterable[BenchRecord], tick_us: int) -> bool:
    """Return whether an input was set twice within a tick, so that some ticks miss a value."""
    latest: dict[str, int] = {}
    for record in records:
        if record.mark is Mark.PHYSICAL and (change := record.change) is not None:
            if record.at_us - latest.get(change[0], -NEVER) < tick_us:
                return True
            latest[change[0]] = record.at_us
    return False


def _begin_with(first: Said, alone: Iterable[Said], tolerance: Tolerance) -> list[int]:
    """Return the start of a recording relative to power-on, if its first output is a greeting.

    Args:
        first: first output of the recording.
        alone: output of the emulator after power-on without input.
        tolerance: the tolerances.
    """
    found = (said.at_us for said in alone if tolerance.same(first.text, said.text))
    return [at_us - first.at_us for at_us in islice(found, 1)]


def _closest(runs: Iterable[_ComparedRun], until_us: int, tolerance: Tolerance) -> _ComparedRun:
    """Return the run with the fewest differences, or the first of several such runs."""

    def differences(run: _ComparedRun) -> int:
        pairs = compare(run.recorded, run.emulated, until_us, tolerance)
        return sum(bool(pair.difference) for pair in pairs)

    return min(runs, key=differences)


def _play(
    configured: ConfiguredDevice, records: Iterable[BenchRecord], begin_us: int, end_us: int
) -> list[Said]:
    """Return the output of the emulator, from the start of the recording."""
    emulator = Emulator(configured.type.name, configured.device, line=configured.type.line)
    said: list[Said] = []

    def hear(line: WireLine) -> None:
        if line.mark is Mark.FROM_DEVICE:
            said.append(Said(line.at_us - begin_us, escape(line.data)))

    emulator.log.listeners.append(hear)
    for number, record in enumerate(records):
        at_us = begin_us + record.at_us
        if record.mark is Mark.PHYSICAL or (record.mark is Mark.TO_DEVICE and at_us >= 0):
            emulator.event_queue.put(number, max(0, at_us), partial(_act, emulator, record))
    emulator.event_queue.put("end", end_us, lambda now_us: emulator.stop())
    while emulator.running and emulator.rig.now_us < NEVER:
        emulator.step()
    return said


def _act(emulator: Emulator, record: BenchRecord, now_us: int) -> None:
    """Repeat an action of the recorded host or operator."""
    if isinstance(record.traffic, bytes) and record.mark is Mark.TO_DEVICE:
        emulator.send(now_us, record.traffic)
    else:
        replay.do(emulator.device, record)


def _cut(split: Splitter, traffic: Iterable[tuple[int, object, int]]) -> Iterator[Said]:
    """Yield the lines of the traffic, each with time and line number of its end."""
    for at_us, data, line in traffic:
        assert isinstance(data, bytes)
        for whole in split(at_us, data):
            yield Said(at_us, escape(whole), line)


# Recorded frames of nodes on a CAN bus, and frames of emulated nodes for the same master.

_ALWAYS: Final = (0x080, 0x580, 0x700)
"""CAN-IDs of a node without an object: EMCY, answers of its SDO server, heartbeat."""

_EMCY: Final = (0x1014, 0)
_SDO_SERVERS: Final = range(0x1200, 0x1280)
_TPDOS: Final = range(0x1800, 0x1A00)
_UNUSED: Final = 1 << 31
_CAN_ID: Final = 0x1FFF_FFFF


def _compare_node_ticks(recording: replay.BenchRecording, name: str, node: Node) -> _ComparedRun:
    """Replay the recorded ticks on a node.

    Args:
        recording: the recording, made at the device.
        name: name of the node.
        node: a new node.
    """
    recorded = [
        Said(at_us, str(frame), line)
        for at_us, frames, line in replay.traffic_of(recording.of(name), Mark.FROM_DEVICE)
        for frame in frames
    ]
    emulated = [
        Said(at_us, str(frame))
        for at_us, frames in replay.play_device(recording, name, node)
        for frame in frames
    ]
    return _ComparedRun(recorded, emulated)


def _compare_bus(
    recording: replay.BenchRecording,
    make: Callable[[CanWire], Sequence[Node]],
    tolerance: Tolerance,
    settle_us: int,
    bit_rate: int,
) -> _ComparedRun:
    """Replay the recorded frames of all other nodes on a bus with emulated nodes, at their times.

    The frames of a node are identified by the CAN-IDs that its dictionary has at that time.

    Args:
        recording: the recording, made at a port of the bus.
        make: function that makes the nodes on a bus.
        tolerance: tolerances. Their time is also the time after the end of the recording in which
            the nodes may still answer.
        settle_us: time for which the nodes are on before the recording starts. If the first frame
            is a frame after power-on, a start at power-on is tried too, and the closer run counts.
        bit_rate: bit rate of the bus in bit/s.
    """
    records = [x for x in recording.records if isinstance(x.traffic, CanFrame) or x.text]
    until_us = recording.until_us + tolerance.allowed_us(recording.until_us)

    def run(begin_us: int) -> _ComparedRun:
        bus = _Bus(make, bit_rate, begin_us)
        emulated = bus.play(records, begin_us + until_us)
        return _ComparedRun(bus.recorded, [x for x in emulated if x.at_us >= -tolerance.time_us])

    settled = run(settle_us)
    begins = []
    if settled.recorded:
        alone = _Bus(make, bit_rate, 0).play((), _SEARCHED_US)
        begins = _begin_with(settled.recorded[0], alone, tolerance)
    return _closest([settled, *map(run, begins)], recording.until_us, tolerance)


class _Bus:
    """Emulated nodes, and recorded frames of all other nodes."""

    def __init__(
        self, make: Callable[[CanWire], Sequence[Node]], bit_rate: int, begin_us: int
    ) -> None:
        self._wire, self._begin_us = CanWire(bit_rate), begin_us
        self._nodes = {node.name: node for node in make(self._wire)}
        self._rig = Rig(*(Station(node, node.port) for node in self._nodes.values()))
        self._host = self._wire.end(frozenset())
        self._host.auto_recovery = True
        self._wire.end(frozenset())  # one that acknowledges what the host sends
        self._ids = {name: _Produced(node.slave) for name, node in self._nodes.items()}
        self._wire.observers.append(self._hear)
        self.recorded: list[Said] = []
        self._said: list[Said] = []

    def play(self, records: Iterable[BenchRecord], end_us: int) -> list[Said]:
        """Send to emulated nodes what a recorded host sent, and return the frames of the nodes.

        Args:
            records: lines of the recording.
            end_us: time at which the replay ends, in microseconds.
        """
        for number, record in enumerate(records):
            at_us = max(0, self._begin_us + record.at_us)
            early = self._begin_us + record.at_us < 0
            self._rig.event_queue.put(number, at_us, partial(self._act, record, early))
        self._rig.run_to(end_us)
        return self._said

    def owns(self, traffic: object) -> bool:
        """Return whether an emulated node sends frames like the given frame."""
        return isinstance(traffic, CanFrame) and any(x.has(traffic) for x in self._ids.values())

    def _act(self, record: BenchRecord, early: bool, now_us: int) -> None:
        """Repeat an action of host or operator.

        If `early` is true, the action happened before the nodes were switched on.
        """
        frame = record.traffic
        if not isinstance(frame, CanFrame):
            self._do(record)
        elif record.mark is Mark.FROM_DEVICE and self.owns(frame):
            self.recorded.append(Said(record.at_us, str(frame), record.line))
        elif not early:
            self._host.send(now_us, (frame,))

    def _do(self, record: BenchRecord) -> None:
        """Repeat a manual action, such as `5/power_off=1`; the ID of an only node may be absent."""
        prefix, slash, text = record.text.partition("/")
        node = self._nodes.get(prefix) if slash else next(iter(self._nodes.values()))
        if node is None:
            raise ValueError(f"line {record.line}: no node {prefix!r:.60}")
        replay.do(node, record._replace(text=text if slash else record.text))

    def _hear(self, at_us: int, passed: CanFrame | ErrorFrame) -> None:
        if self.owns(passed):
            self._said.append(Said(at_us - self._begin_us, str(passed)))


class _Produced:
    """Frames of a slave."""

    def __init__(self, slave: CanopenSlave) -> None:
        self._slave = slave
        wanted = [_EMCY, *((x, 2) for x in _SDO_SERVERS), *((x, 1) for x in _TPDOS)]
        found = [slave.dictionary.find(*each) for each in wanted]
        self._entries = [entry for entry in found if entry is not None]

    def has(self, frame: CanFrame) -> bool:
        if frame.can_id - self._slave.node_id in _ALWAYS:
            return not frame.remote
        numbers = (entry.number for entry in self._entries)
        return not frame.remote and any(
            number & _CAN_ID == frame.can_id and not number & _UNUSED for number in numbers
        )


# What `tickrig compare` prints: the first difference, the others, and a table of all.

_SHOWN: Final = 20
"""Largest number of listed differences."""

_HEAD: Final = ("", "recorded", "emulated", "different", "worst")


def report(
    file: str, pairs: Mapping[str, Sequence[Pair]], tolerance_us: int, *, everything: bool
) -> tuple[list[str], bool]:
    """Return the lines that `tickrig compare` prints, and whether the two runs are equal.

    Args:
        file: name of the trace.
        pairs: pairs of a recorded line and the corresponding line of the emulator, by name of the
            device.
        tolerance_us: tolerance of the times in microseconds.
        everything: whether equal lines are listed, too.
    """
    rows = sorted(
        ((name, pair) for name, said in pairs.items() for pair in said),
        key=lambda row: row[1].at_us,
    )
    different = [row for row in rows if row[1].difference]
    listed = rows if everything else different[:_SHOWN] if len(different) > 1 else []
    left = len(different) - len(listed) if listed and not everything else 0
    count = sum(pair.recorded is not None for _, pair in rows)
    result = f"different: {len(different)} of" if different else "same:"
    sections = (
        list(_first(file, *different[0])) if different else [],
        [_row(name, pair) for name, pair in listed] + [f"... and {left} more"] * bool(left),
        _table(pairs),
        [f"{result} {counted(count, 'line')}, within {tolerance_us / 1_000:g} ms"],
    )
    lines = [line for section in sections if section for line in ("", *section)]
    return lines[1:], not different


def _first(file: str, name: str, pair: Pair) -> Iterator[str]:
    place = f" ({file}:{pair.recorded.line})" if pair.recorded and pair.recorded.line else ""
    yield f"different at {format_time(max(0, pair.at_us))} {name}{place}: {pair.difference}"
    yield f"  recorded < {_text(pair.recorded)}"
    yield f"  emulated < {_text(pair.emulated)}"


def _text(said: Said | None) -> str:
    return f"{said.text}  at {format_time(max(0, said.at_us))}" if said else "(nothing)"


def _row(name: str, pair: Pair) -> str:
    old, new = pair.recorded, pair.emulated
    late = f"{pair.late_us / 1_000:+9.1f}" if old and new else " " * 9
    sign = "!" if pair.difference else " "
    text = old.text if old else new.text if new else ""
    if old and new and old.text != new.text:
        text = f"{old.text} | {new.text}"
    missing = "" if old and new else "  (emulator alone)" if new else "  (recorded alone)"
    return f"{sign} {format_time(max(0, pair.at_us))} {late} ms  {name} {text}{missing}"


def _table(pairs: Mapping[str, Sequence[Pair]]) -> list[str]:
    rows = [_HEAD]
    for name, said in pairs.items():
        kinds: dict[str, list[Pair]] = {}
        for pair in said:
            kinds.setdefault(pair.kind, []).append(pair)
        rows += [_counts(f"{name} {kind}".strip(), kinds[kind]) for kind in sorted(kinds)]
    return aligned(rows, left=1)


def _counts(name: str, pairs: Sequence[Pair]) -> tuple[str, str, str, str, str]:
    worst_us = max((abs(pair.late_us) for pair in pairs), default=0)
    return (
        name,
        str(sum(pair.recorded is not None for pair in pairs)),
        str(sum(pair.emulated is not None for pair in pairs)),
        str(sum(bool(pair.difference) for pair in pairs)),
        f"{worst_us / 1_000:.1f} ms",
    )


# `tickrig compare`: the runs that its command line names.

_BIT_RATE: Final = 1_000_000


def run_compare(file: Path, *, verbose: bool, **options: Any) -> int:
    """Run `tickrig compare` on a trace, and return the exit status."""
    tolerance = _read_tolerance(options)
    try:
        recording = replay.read_bench_recording(file.read_bytes())
        _refuse_idle(recording, options)
        mine = [*user_code(recording.header.devices.values()), *_given_code(options)]
        with mistakes_in(mine):
            runs = dict(_runs(file, recording, tolerance, options))
    except OSError as error:
        refuse_path("trace", error)
    except ValueError as error:
        raise Refused(f"trace {file}: {error}") from None
    if not any(run.recorded for run in runs.values()):
        raise Refused(f"trace {file}: no device says anything in it that could be compared")
    if not recording.ended:
        say(f"{file}: no end line (killed?); its last tick is left out")
    pairs = {
        name: compare(run.recorded, run.emulated, recording.until_us, tolerance)
        for name, run in runs.items()
    }
    lines, same = report(str(file), pairs, tolerance.time_us, everything=verbose)
    for line in lines:
        click.echo(line)
    return 0 if same else 1


_OF_DEVICES: Final = ("type_name", "config", "nodes", "settle_us")
"""Options that define how devices are made, and when their power comes on."""


def _refuse_idle(recording: replay.BenchRecording, options: Mapping[str, Any]) -> None:
    """Refuse options that would do nothing with any device of a trace."""
    used: set[str] = set()
    for name in recording.header.devices:
        if recording.at_port:
            of_port = ("nodes",) if recording.header.on_can(name) else ("type_name", "config")
            used |= {*of_port, "settle_us"}
        elif not recording.header.on_can(name):
            used |= {"type_name", "config"} if options["type_name"] else {"type_name"}
    why = "this is a recording of a port, without such a device"
    if not recording.at_port:
        why = "the devices are made as the trace of their ticks says"
        why += ", or of --type and --config" * ("type_name" in used)
    refuse_idle(why, *(name for name in _OF_DEVICES if name not in used))


def _given_code(options: Mapping[str, Any]) -> list[str]:
    """Return texts in --node and --config that may be a `FILE.py:Class` of a user."""
    return [text.partition("=")[2] for text in (*options["nodes"], *options["config"])]


def _read_tolerance(options: Mapping[str, Any]) -> Tolerance:
    with refused_at("--number"):
        numbers = [parse_number_rule(text) for text in options["numbers"]]
    return Tolerance(options["time_us"], numbers, options["ignore"], options["kinds"])


def _runs(
    file: Path, recording: replay.BenchRecording, tolerance: Tolerance, options: Mapping[str, Any]
) -> Iterator[tuple[str, _ComparedRun]]:
    """Yield the two runs of each device; the nodes of a recorded bus have two runs together."""
    for name in recording.header.devices:
        if not recording.at_port:
            yield name, _ticked(file, recording, name, options)
        elif recording.header.on_can(name):
            yield name, _on_bus(recording, name, tolerance, options)
        else:
            yield name, _on_line(recording, name, tolerance, options)


def _ticked(
    file: Path, recording: replay.BenchRecording, name: str, options: Mapping[str, Any]
) -> _ComparedRun:
    """Compare tick by tick."""
    header = recording.header
    entry, on_can = header.devices[name], header.on_can(name)
    if options["type_name"] and not on_can:
        return _compare_ticks(recording, name, _configured(options, ""))
    device = make_recorded(header, name, file.parent, EdsCache(), run_code=options["run_code"])
    if on_can:
        return _compare_node_ticks(recording, name, device)
    configured = ConfiguredDevice(DEVICES.load(entry.type), device, entry.config)
    return _compare_ticks(recording, name, configured)


def _on_line(
    recording: replay.BenchRecording, name: str, tolerance: Tolerance, options: Mapping[str, Any]
) -> _ComparedRun:
    """Compare the traffic of a serial port."""
    recorded = recording.header.devices[name].type
    if not (recorded or options["type_name"]):
        raise ValueError("it does not say of which type the device is: add --type, as --type rrc")

    def make() -> ConfiguredDevice:
        return _configured(options, recorded)

    return _compare_port(recording, name, make, tolerance, options["settle_us"])


def _on_bus(
    recording: replay.BenchRecording, name: str, tolerance: Tolerance, options: Mapping[str, Any]
) -> _ComparedRun:
    """Compare the traffic of a bus."""
    try:
        specs = [spec for text in options["nodes"] for spec in parse_node(text)]
        described = describe_nodes(specs)
    except ValueError as error:
        raise Refused(str(error)) from None
    if not specs:
        raise ValueError("which nodes were on the bus? add --node, as --node 5=epos")
    show_findings(odd for item in described for odd in item.description.warnings)
    wire = recording.header.wires[recording.header.devices[name].wire]
    bit_rate = wire.config.get("bit_rate", _BIT_RATE)
    if not isinstance(bit_rate, int):
        raise ValueError(f"its bit rate is {bit_rate!r:.60}")
    return _compare_bus(
        recording, lambda bus: make_nodes(described, bus), tolerance, options["settle_us"], bit_rate
    )


def _configured(options: Mapping[str, Any], recorded: str) -> ConfiguredDevice:
    """Make the device of --type and --config, or of the trace."""
    name = options["type_name"] or recorded
    if name not in DEVICES.names():
        raise Refused(f"no device type {name!r:.60}; {near(name, DEVICES.names())}")
    words: Sequence[str] = options["config"]
    with refused_at("--config"):
        config = {}
        for word in words:
            key, equals, value = word.partition("=")
            if not equals:
                raise ValueError(f"{word!r} is not NAME=VALUE")
            config[key] = parse_setting(value)
        return configure(name, config)
