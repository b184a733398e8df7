"""Make nodes from files and models, and put them on a bus."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tickrig.device.canopen.device_rtc import CanopenComponent, make_device_rtc, make_dictionary
from tickrig.device.canopen.device_rtc import application_of as application_of_component
from tickrig.device.canopen.sdo import USUAL, SdoLimits
from tickrig.device.canopen.slave import UNCONFIGURED
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.bench.operator import WireFaults
from tickrig.emulators.can.emulator import CanEmulator
from tickrig.emulators.can.outside.bridge import CountingPort
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.body import BodyOnDrives
from tickrig.emulators.canopen.choices import AUTO, LSS, is_bus_node
from tickrig.emulators.canopen.eds import DeviceDescription, EdsCache
from tickrig.emulators.canopen.faults import NodeFaults
from tickrig.emulators.canopen.models import MODELS
from tickrig.emulators.canopen.node import Node, SecondNodeAlarm, side_of
from tickrig.emulators.canopen.node_spec import NodeSpec
from tickrig.emulators.canopen.store_file import StoreFile
from tickrig.emulators.record.recorder import CandumpFile
from tickrig.emulators.rig.clock import Clock
from tickrig.emulators.rig.station import Station
from tickrig.host.text.log import log_of
from tickrig.host.text.names import near
from tickrig.host.text.user_file import explain_error, find_class
from tickrig.wire.rtc_canopen import device_info

if TYPE_CHECKING:
    from tickrig.emulators.canopen.bus_file.bus_nodes import BusNodes


@dataclass(frozen=True, slots=True)
class Described:
    """A node to be emulated: its name, its node-ID and the description of its device.

    Attributes:
        name: prefix of the signals of the node, and key of its memory in a store file.
        node_id: node-ID 1..127, or `UNCONFIGURED`.
        description: description of the device in its file or model.
        about: text about the part of a robot that the node moves, or empty if unknown.
    """

    name: str
    node_id: int
    description: DeviceDescription
    about: str = ""


def describe_nodes(specs: Iterable[NodeSpec], profile: str = AUTO) -> list[Described]:
    """Read the files and models of the nodes of a command line.

    Args:
        specs: the nodes.
        profile: name of a profile in `choices.PROFILES`. It is used for each node without a profile
            of its own.

    Raises:
        ValueError: a file is unusable, or a node-ID is missing or duplicate.
    """
    cache, found = EdsCache(), dict[str, Described]()
    for spec in specs:
        description = describe(cache, spec.device, spec.profile or profile)
        node_id = spec.node_id if spec.node_id is not None else description.node_id
        if node_id is None:
            raise ValueError(
                f"{spec.device} gives no node-ID: add --node-id 1..127, or --node-id {LSS} for a"
                " node that waits for LSS"
            )
        name = _name(node_id, found)
        if name in found:
            raise ValueError(
                f"node {name} is there twice: {found[name].description.file}, {spec.device}"
            )
        found[name] = Described(name, node_id, description)
    return list(found.values())


def describe_device(name: str) -> DeviceDescription:
    """Describe a model, or the DeviceRTC of a user's file; raise ValueError if unknown."""
    if name in MODELS:
        return MODELS[name].describe()
    return describe_rtc(name)


def make_nodes(
    described: Iterable[Described],
    wire: CanWire,
    store: StoreFile | None = None,
    sdo: SdoLimits = USUAL,
) -> list[Node]:
    """Make the nodes, with their memory from an earlier run."""
    nodes = []
    for item in described:
        description = item.description
        dictionary = description.make_dictionary()
        memory = store.nonvolatile(item.name, dictionary) if store else None
        slave = make_slave(dictionary, item.node_id, memory, description.application, sdo)
        nodes.append(node := Node(item.name, slave, wire))
        node.begin_with(description.start)
    return nodes


def describe(cache: EdsCache, device: Path | str, profile: str = AUTO) -> DeviceDescription:
    """Return the description of a device from its file, model or class.

    Args:
        cache: cache of EDS files.
        device: EDS or DCF of the node, name of a model, `FILE.yml:NODE` of a bus.yml, or
            `FILE.py:Class` of a DeviceRTC.
        profile: profile for an EDS or DCF, which is a name of `choices.PROFILES`.

    Raises:
        ValueError: there is no such device, or its file is unusable.
    """
    if isinstance(device, str):
        return _bus_node(cache, device) if is_bus_node(device) else describe_device(device)
    return _read(cache, device, profile)


def read_bus_file(file: Path, urdf: Path | None, cache: EdsCache, profile: str = AUTO) -> BusNodes:
    """Read a bus.yml, in which ros2_canopen and dcfgen describe the nodes of a CANopen bus.

    Args:
        file: path of the bus.yml.
        urdf: URDF of the robot with the joints, or None for the robot that the file names.
        cache: cache of EDS files.
        profile: profile for nodes without a profile, which is a name of `choices.PROFILES`.

    Raises:
        ValueError: the file has errors. The message has all errors, one per line.
    """
    from tickrig.emulators.canopen.bus_file.bus_nodes import read_bus  # noqa: PLC0415 - slow

    try:
        return read_bus(file, urdf, cache, profile)
    except OSError as error:
        raise ValueError(_unreadable(error)) from None
    except ImportError as error:  # no YAML
        raise ValueError(str(error)) from None


def _unreadable(error: OSError) -> str:
    return f"file {error.filename}: {error.strerror or error}"


def _bus_node(cache: EdsCache, spec: str) -> DeviceDescription:
    """Describe the node of `FILE.yml:NODE`."""
    file, _, name = spec.rpartition(":")
    nodes = read_bus_file(Path(file), None, cache).nodes
    found = next((node for node in nodes if node.name == name), None)
    if found is None:
        raise ValueError(f"{file}: no node {name!r}; {near(name, [node.name for node in nodes])}")
    return found.description


def _read(cache: EdsCache, file: Path, profile: str) -> DeviceDescription:
    try:
        return cache.read(file, profile)
    except OSError as error:
        raise ValueError(_unreadable(error)) from None


def _name(node_id: int, found: dict[str, Described]) -> str:
    """Return the node-ID as name; nodes that wait for a node-ID are lss, lss2, ..."""
    if node_id != UNCONFIGURED:
        return str(node_id)
    count = sum(item.node_id == UNCONFIGURED for item in found.values())
    return f"{LSS}{count + 1}" if count else LSS


ANY_ID: Final = 1


_NODE_INPUTS: Final = ("power_off", "unplugged", "emergency")
"""Inputs that every node has in addition to the inputs of its device."""


def describe_rtc(spec: str) -> DeviceDescription:
    """Return the description of the device on which the component `FILE.py:Class` runs.

    Args:
        spec: path of the Python file and name of the class.

    Raises:
        ValueError: the file cannot be run, or the component is not a valid DeviceRTC.
    """
    kind: type[CanopenComponent] = find_class(spec, CanopenComponent)
    for item in kind.physical:
        if item.name in _NODE_INPUTS:
            raise ValueError(f"{spec}: input {item.name!r} is one that every node has")
    try:
        make_device_rtc(kind, ANY_ID)
    except Exception as error:  # a user's constructor may raise anything
        raise ValueError(f"{spec}: {explain_error(error, spec.rpartition(':')[0])}") from None
    return DeviceDescription(
        spec,
        device_info(kind.profile()),
        make_dictionary(kind),
        application=application_of_component(kind),
    )


_NAME: Final = "canopen-slave"

_logger = log_of(__name__)


def make_bench(  # noqa: PLR0913 - options, by keyword
    wire: CanWire,
    nodes: Sequence[Node],
    bodies: Sequence[BodyOnDrives] = (),
    *,
    outside: CountingPort | None = None,
    link: str = "",
    trace: CandumpFile | None = None,
    clock: Clock | None = None,
    faults: WireFaults | None = None,
    node_faults: Sequence[NodeFaults] = (),
) -> CanEmulator:
    """Assemble nodes, bodies, the bus outside, a clock and faults into an emulator."""
    stations = [Station(node, node.port) for node in nodes]
    for one, station in zip(node_faults, stations, strict=False):
        one.station = station
    return CanEmulator(
        _NAME,
        side_of(nodes, bodies),
        stations,
        wire,
        couplings=bodies,
        outside=SecondNodeAlarm(outside, nodes) if outside else None,
        clock=clock,
        trace=trace,
        link=link,
        faults=faults,
    )


def store_keeper(store: StoreFile) -> Callable[[int], None]:
    """Return a function that writes the store file if a node has stored something.

    The emulator calls the function after each step. If writing fails, the function logs one warning
    and retries at later calls.
    """
    failed = False

    def keep(now_us: int) -> None:
        nonlocal failed
        try:
            store.save()
            failed = False
        except OSError as error:
            if not failed:
                _logger.warning("store %s: %s; the emulator goes on", store.path, error.strerror)
            failed = True

    return keep
