"""Run CANopen slaves for a command line: on a CAN bus, or a scenario."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Final, NamedTuple

import click

from tickrig.device.canopen.sdo import USUAL, SdoLimits
from tickrig.device.canopen.slave import UNCONFIGURED
from tickrig.emulators.bench.operator import AssemblyFaults, Operator
from tickrig.emulators.bench.running_emulator import RunningEmulator, Transcript
from tickrig.emulators.can.emulator import CanEmulator
from tickrig.emulators.can.outside.bridge import CountingPort
from tickrig.emulators.can.outside.bus_port import port_on
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen import build
from tickrig.emulators.canopen.body import BodyPlan
from tickrig.emulators.canopen.choices import AUTO
from tickrig.emulators.canopen.eds import EdsCache, profile_name
from tickrig.emulators.canopen.faults import NodeFaults
from tickrig.emulators.canopen.node import side_of
from tickrig.emulators.canopen.node_spec import NodeSpec, parse_ids, parse_node
from tickrig.emulators.canopen.store_file import StoreError, StoreFile
from tickrig.emulators.commands.run import EmulatorRun, RunOptions, mistakes_in
from tickrig.emulators.record.recorder import CandumpFile
from tickrig.emulators.rig.event_queue import EventQueue
from tickrig.emulators.scenario import ScenarioParser, ScenarioPlayer, ScenarioStep, Send
from tickrig.emulators.testing.rig_file.plan import DeviceKind, DevicePlan, RigFileError, RigPlan
from tickrig.emulators.testing.rig_file.probe import eds_cache
from tickrig.emulators.testing.rig_file.reader import read_rig_file
from tickrig.emulators.testing.signals.sources import SignalSpec
from tickrig.host.canopen.bus_file.bus_file import is_bus_file
from tickrig.host.cli.can_options import BusOptions, open_raw
from tickrig.host.cli.messages import Refused, refuse_path, say, show_findings
from tickrig.host.cli.options import refuse_idle
from tickrig.host.links.can_link import close_bus
from tickrig.host.text.values import counted, parse_size, parse_time_us
from tickrig.host.text.whole_file import write_whole
from tickrig.wire.can import CanFrame, LogLine
from tickrig.wire.canopen.eds.eds_writer import write_eds as format_eds

_VIRTUAL_CHANNEL: Final = "can0"
_BIT_RATE: Final = 1_000_000
_SHOWN_NODES: Final = 8
_HOW: Final = "Add --control PATH to set the objects from the inside, -vv to see the frames."
_NO_NODE: Final = (
    "no node: give --eds FILE --node-id N, --model NAME, --rtc, --node, --rig FILE or --bus FILE"
)


class _BusYml(NamedTuple):
    """Files that define the nodes: a bus.yml, and a URDF file.

    Attributes:
        file: path of the bus.yml, or None without one.
        urdf: path of the URDF file of the robot with the joints. None stands for no file, or for
            the file that the bus.yml names.
    """

    file: Path | None = None
    urdf: Path | None = None


def open_bus(options: BusOptions, stack: ExitStack) -> tuple[CountingPort, str, str]:
    """Open the CAN bus that the options, the environment or python-can's configuration files name.

    Args:
        options: options of the command line for the bus.
        stack: exit stack that closes the bus at the end.

    Returns:
        The bus, its name for messages, and its name in logs.

    Raises:
        Refused: no bus is given, or the bus cannot be opened.
    """
    instead = "give --scenario FILE, which runs in virtual time"
    bus, interface, channel = open_raw(options, instead)
    stack.callback(close_bus, bus)
    name = interface if channel is None else f"{interface} {channel}"
    label = "_".join(str(channel).split()) if channel not in (None, "") else interface
    return port_on(bus, interface, f"CAN bus {name}"), name, label


class _RigNodes(NamedTuple):
    """Content of a rig file.

    Attributes:
        nodes: nodes by their names in the rig file.
        body: body that the nodes move, or None without a body.
    """

    nodes: tuple[build.Described, ...] = ()
    body: BodyPlan | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class _CanopenOptions(RunOptions):
    """The command line.

    Attributes:
        specs: the nodes.
        rig: nodes of a rig file, in addition to `specs`, and the body that the nodes move.
        bus_yml: files that define the nodes, instead of `specs` and `rig`.
        profile: profile of nodes that files describe; see `choices.PROFILES`.
        bus: the outside bus.
        store: file in which nodes keep the values stored by object 1010h and by LSS.
        sdo: limits of the SDO servers of all nodes.
    """

    specs: tuple[NodeSpec, ...] = ()
    rig: _RigNodes = field(default_factory=_RigNodes)
    bus_yml: _BusYml = field(default_factory=_BusYml)
    profile: str = AUTO
    bus: BusOptions = field(default_factory=BusOptions)
    store: Path | None = None
    sdo: SdoLimits = USUAL

    @property
    def in_real_time(self) -> bool:
        """Whether the nodes run in real time. A scenario without a bus runs in virtual time."""
        return not self.scenario or bool(self.bus or self.control)


class _FrameTranscript(Transcript):
    """Actions of the operator, watched outputs and missed expectations, without the frames.

    Args:
        emulator: the emulator to watch.
        write: function that receives the lines.
    """

    def __init__(self, emulator: RunningEmulator, write: Callable[[str], None]) -> None:
        super().__init__(emulator, write, lambda line: False)

    def send(self, now_us: int, data: bytes, shown: bytes) -> None:
        """Send a frame as a host; the log shows the frame once it was transmitted on the bus."""
        self._emulator.send(now_us, data)


class _CanopenRun(EmulatorRun[_CanopenOptions]):
    """One run; see `_CanopenOptions`."""

    def __init__(self, options: _CanopenOptions) -> None:
        super().__init__(options)
        self._described: list[build.Described] = []
        self._channel = _VIRTUAL_CHANNEL

    def _make(self) -> tuple[Operator, ScenarioParser]:
        try:
            self._described = self._describe()
        except ValueError as error:
            raise Refused(str(error)) from None
        if not self._described:
            raise Refused(_NO_NODE)
        show_findings(odd for item in self._described for odd in item.description.warnings)
        self._wire, body = self._make_wire(), self._options.rig.body
        self._store = self._open_store()
        self._nodes = build.make_nodes(self._described, self._wire, self._store, self._options.sdo)
        self._bodies = [body.put_on(self._nodes)] if body else []
        device = side_of(self._nodes, self._bodies)
        self._node_faults = [NodeFaults(node, self._wire) for node in self._nodes]
        self._faults = AssemblyFaults(
            {"can": self._wire.faults},
            {one.node.name: one for one in self._node_faults},
            self._nodes[0].name if len(self._nodes) == 1 else "",
        )
        operator = Operator(device.inputs, device.tick_us, EventQueue(), self._faults)
        return operator, ScenarioParser(device, operator, senders={"send": parse_send})

    def _describe(self) -> list[build.Described]:
        """Read the files of the nodes; raise ValueError with all errors."""
        options, (file, urdf) = self._options, self._options.bus_yml
        if file is None:
            given = build.describe_nodes(options.specs, options.profile)
            taken = {item.node_id: item for item in given if item.node_id != UNCONFIGURED}
            for item in options.rig.nodes:
                if first := taken.get(item.node_id):
                    raise ValueError(
                        f"node {item.node_id} is there twice: {first.description.file}, {item.name}"
                    )
            return [*given, *options.rig.nodes]
        bus = build.read_bus_file(file, urdf, EdsCache(), options.profile)
        for remark in bus.remarks:
            say(remark)
        return [
            build.Described(node.name, node.node_id, node.description, node.about)
            for node in bus.nodes
        ]

    def _make_wire(self) -> CanWire:
        options = self._options
        rate = options.bus.bitrate or self._described[0].description.bit_rate or _BIT_RATE
        try:
            return CanWire(rate, options.seed)
        except ValueError as error:
            raise Refused(str(error)) from None

    def _open(self, stack: ExitStack) -> CanEmulator:
        outside, link = None, ""
        if self._options.in_real_time:
            outside, link, self._channel = open_bus(self._options.bus, stack)
        wire = self._wire
        trace = self._open_trace(wire)
        bench = build.make_bench(
            wire,
            self._nodes,
            self._bodies,
            outside=outside,
            link=link,
            trace=trace,
            clock=self._clock if outside else None,
            faults=self._faults,
            node_faults=self._node_faults,
        )
        if self._store:
            bench.after_step.append(build.store_keeper(self._store))
        if self._options.scenario or self._options.verbose > 1:
            wire.observers.append(lambda at, x: click.echo(str(LogLine(at, self._channel, x))))
        return bench

    def _open_store(self) -> StoreFile | None:
        if self._options.store is None:
            return None
        try:
            return StoreFile(self._options.store)
        except StoreError as error:
            raise Refused(f"store {error}") from None
        except OSError as error:
            refuse_path("store", error)

    def _open_trace(self, wire: CanWire) -> CandumpFile | None:
        if self._options.trace is None:
            return None
        try:
            trace = CandumpFile(self._options.trace, self._channel)
        except OSError as error:
            refuse_path("trace", error)
        wire.observers.append(trace.hear)
        return trace

    def _attend(
        self, bench: RunningEmulator, scenario: tuple[ScenarioStep, ...]
    ) -> ScenarioPlayer | None:
        options = self._options
        if not (options.scenario or options.verbose):
            return None
        transcript = _FrameTranscript(bench, say)
        if options.verbose:
            outputs = bench.device.outputs.items()
            transcript.watch(0, *(name for name, item in outputs if not item.unit))
        return ScenarioPlayer(bench, scenario, transcript, stays=options.in_real_time)

    def _greet(self, bench: RunningEmulator) -> None:
        if self._options.bus_yml.file:
            self._greet_bus(bench, self._options.bus_yml.file)
            return
        nodes = [f"{item.name} ({item.description.file})" for item in self._described]
        more = f" and {len(nodes) - _SHOWN_NODES} more" if len(nodes) > _SHOWN_NODES else ""
        say(f"CANopen slave {', '.join(nodes[:_SHOWN_NODES])}{more} on {bench.link}. Ctrl-C ends.")
        self._say_how(_HOW)

    def _greet_bus(self, bench: RunningEmulator, file: Path) -> None:
        """Print a line for each node."""
        say(f"{counted(len(self._described), 'CANopen slave')} of {file} on {bench.link}:")
        for item in self._described:
            what = item.about or _PROFILE_TEXTS[profile_name(item.description.application)]
            sheet = Path(item.description.file).name
            say(f"  {item.name}  node-ID {item.node_id}  {sheet}  {what}")
        say("Ctrl-C ends.")
        self._say_how(_HOW)


def parse_send(rest: str) -> Send:
    """Read a frame in candump's notation."""
    data = str(CanFrame.parse(rest)).encode()
    return Send(data, data)


_PROFILE_TEXTS: Final = {"401": "CiA 401", "402": "CiA 402", "none": "its objects alone"}
_BUS_FIELDS: Final = ("interface", "channel", "bitrate", "timing", "bus_kwargs")
_DEVICES: Final = ("eds", "dcf", "model", "rtc")
"""Options that name the device of a node; only one of them may be given."""

_STANDARD_OUTPUT: Final = Path("-")


def emulate(
    node_id: str | None,
    nodes: tuple[str, ...],
    rig: Path | None,
    bus_yml: tuple[Path | None, Path | None],
    options: dict[str, Any],
) -> int:
    """Run slaves for a command line, and return the exit status."""
    given = {f"--{name}": options.pop(name) for name in _DEVICES}
    _check_bus_yml(*bus_yml, {**given, "--node-id": node_id, "--node": nodes, "--rig": rig})
    bus = BusOptions(**{name: options.pop(name) for name in _BUS_FIELDS})
    try:
        specs = (*_specs(given, node_id), *_more(nodes))
    except ValueError as error:
        raise Refused(str(error)) from None
    if bus_yml[0] is None and not any(isinstance(spec.device, Path) for spec in specs):
        refuse_idle("it is for nodes of an EDS, DCF or XDD", "profile")
    file = _RigNodes() if rig is None else read_rig(rig)
    sdo = _sdo_limits(options.pop("sdo_timeout"), options.pop("sdo_memory"))
    run = _CanopenRun(
        _CanopenOptions(
            specs=specs, rig=file, bus_yml=_BusYml(*bus_yml), bus=bus, sdo=sdo, **options
        )
    )
    files = [node.description.file for node in file.nodes]
    with mistakes_in([*(spec.device for spec in specs), *files]):
        return run.run()


_MORE_THAN_NODES: Final = "there is more than nodes on one bus ({what}): tickrig run {path}"


def read_rig(path: Path) -> _RigNodes:
    """Read the CANopen nodes of a rig file, and the mechanical body that their drives move.

    Raises:
        Refused: the file cannot be read or has errors. The same exception is raised if the file has
            several wires, serial devices, signals or scheduled faults, because this command runs
            only nodes on one bus.
    """
    try:
        if is_bus_file(path.read_bytes()):
            raise Refused(f"rig {path}: it is a bus.yml: --bus {path}")
        plan = read_rig_file(path)
    except RigFileError as error:
        raise Refused(str(error)) from None
    except OSError as error:
        refuse_path("rig", error)
    if what := _beyond_nodes(plan):
        raise Refused(f"rig {path}: {_MORE_THAN_NODES.format(what=what, path=path)}")
    return _RigNodes(tuple(map(_described, plan.devices.values())), plan.body)


def _beyond_nodes(plan: RigPlan) -> str:
    """Return the part of a rig file that this command does not support, or ""."""
    for device in plan.devices.values():
        if device.kind is DeviceKind.SERIAL:
            return f"device {device.name}"
        if any(isinstance(value, SignalSpec) for value in device.start.values()):
            return "signals"
    if len(plan.wires) > 1:
        return "several wires"
    return "signals" if plan.signals else "faults" if plan.faults else ""


def _described(device: DevicePlan) -> build.Described:
    kind = Path(device.type) if device.kind is DeviceKind.EDS else device.type
    found = build.describe(eds_cache(), kind, device.profile or AUTO)
    node_id = device.node_id if device.node_id is not None else found.node_id
    assert node_id is not None  # the reader wants one
    start = {key: value for key, value in device.start.items() if not isinstance(value, SignalSpec)}
    return build.Described(device.name, node_id, replace(found, start=start))


def _check_bus_yml(file: Path | None, urdf: Path | None, others: Mapping[str, object]) -> None:
    """Refuse --bus together with other node options, and --urdf without --bus."""
    if file is None:
        if urdf is not None:
            raise Refused("--urdf belongs to --bus: it has the joints of a bus.yml")
        return
    if beside := [option for option, value in others.items() if value]:
        raise Refused(f"--bus names all nodes: it goes without {' and '.join(beside)}")


def write_eds(model: str | None, rtc: str | None, path: Path) -> None:
    """Write the EDS of a model or a component."""
    if not (model or rtc):
        raise Refused("--write-eds belongs to --model or --rtc")
    try:
        description = build.describe_device(model or rtc or "")
    except ValueError as error:
        raise Refused(str(error)) from None
    name = "" if path == _STANDARD_OUTPUT else path.name
    text = format_eds(description.template.description, description.info, file_name=name)
    if path == _STANDARD_OUTPUT:
        click.echo(text, nl=False)
        return
    try:
        write_whole(path, text)
    except OSError as error:
        refuse_path("EDS", error)


def _sdo_limits(timeout: str, memory: str) -> SdoLimits:
    option = "--sdo-timeout"
    try:
        limits = SdoLimits(parse_time_us(timeout))
        option = "--sdo-memory"
        return replace(limits, memory_bytes=parse_size(memory))
    except ValueError as error:
        raise Refused(f"{option}: {error}") from None


def _specs(given: Mapping[str, Path | str | None], node_id: str | None) -> Iterator[NodeSpec]:
    """Yield the nodes of --eds, --dcf, --model or --rtc."""
    named = {option: device for option, device in given.items() if device}
    if len(named) > 1:
        raise Refused(f"{' and '.join(named)} name the same thing: give one of them")
    for device in named.values():
        numbers = parse_ids("--node-id", node_id) if node_id else (None,)
        yield from (NodeSpec(device, number) for number in numbers)
    if node_id and not named:
        raise Refused(
            "--node-id belongs to --eds, --dcf, --model or --rtc; with --node write N=FILE"
        )


def _more(nodes: tuple[str, ...]) -> Iterator[NodeSpec]:
    for text in nodes:
        yield from parse_node(text)
