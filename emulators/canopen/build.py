"""Make nodes of their files and models and put them on a bus."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

from tickrig.device.canopen.core.slave import UNCONFIGURED
from tickrig.device.canopen.sdo.sdo_limits import USUAL, SdoLimits
from tickrig.device.canopen.stack import make_slave
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.choices import AUTO
from tickrig.emulators.canopen.eds.device_description import DeviceDescription
from tickrig.emulators.canopen.eds.eds_cache import EdsCache
from tickrig.emulators.canopen.models import MODELS
from tickrig.emulators.canopen.node.node import Node
from tickrig.emulators.canopen.node.node_spec import LSS, NodeSpec
from tickrig.emulators.canopen.node.store_file import StoreFile
from tickrig.emulators.canopen.profiles import application_of
from tickrig.emulators.canopen.rtc import describe_rtc
from tickrig.host.cli.messages import show_findings
from tickrig.host.cli.refused import Refused, refuse_path
from tickrig.wire.canopen.eds.eds_finding import EdsError


@dataclass(frozen=True, slots=True)
class Described:
    """A node of which all is known.

    Attributes:
        name: what its things are called after, and its memory in a store file.
        node_id: 1..127, or `UNCONFIGURED`.
        description: what its file or model says.
    """

    name: str
    node_id: int
    description: DeviceDescription


def describe_nodes(specs: Iterable[NodeSpec], profile: str = AUTO) -> list[Described]:
    """Read the files; Refused if one cannot be used, or a node-ID is missing or there twice.

    What is not by the standard in a file is told on standard error.

    Args:
        specs: the nodes.
        profile: of `choices.PROFILES`, for nodes of files that name none.
    """
    cache, found = EdsCache(), dict[str, Described]()
    for spec in specs:
        description = _describe(cache, spec.device, spec.profile or profile)
        node_id = spec.node_id if spec.node_id is not None else description.node_id
        if node_id is None:
            raise Refused(
                f"{spec.device} gives no node-ID: add --node-id 1..127, or --node-id {LSS} for a"
                " node that waits for LSS"
            )
        name = _name(node_id, found)
        if name in found:
            raise Refused(
                f"node {name} is there twice: {found[name].description.file}, {spec.device}"
            )
        found[name] = Described(name, node_id, description)
    show_findings(odd for item in found.values() for odd in item.description.warnings)
    return list(found.values())


def describe_device(name: str) -> DeviceDescription:
    """Describe a model, or the DeviceRTC of a user's file; Refused if there is none."""
    if name in MODELS:
        return MODELS[name].describe()
    try:
        return describe_rtc(name)
    except ValueError as error:
        raise Refused(str(error)) from None


def make_nodes(
    described: Iterable[Described],
    wire: CanWire,
    store: StoreFile | None = None,
    sdo: SdoLimits = USUAL,
) -> list[Node]:
    """Make the nodes, with what they stored in an earlier life."""
    nodes = []
    for item in described:
        description = item.description
        dictionary = description.make_dictionary()
        memory = store.nonvolatile(item.name, dictionary) if store else None
        slave = make_slave(dictionary, item.node_id, memory, description.application, sdo)
        nodes.append(Node(item.name, slave, wire))
    return nodes


def _describe(cache: EdsCache, device: Path | str, profile: str) -> DeviceDescription:
    if isinstance(device, str):
        return describe_device(device)
    description = _read(cache, device)
    return replace(description, application=application_of(description.template, profile))


def _read(cache: EdsCache, file: Path) -> DeviceDescription:
    try:
        return cache.read(file)
    except EdsError as error:
        raise Refused(str(error)) from None
    except OSError as error:
        refuse_path("file", error)


def _name(node_id: int, found: dict[str, Described]) -> str:
    """Return the node-ID; nodes that wait for one are lss, lss2, ..."""
    if node_id != UNCONFIGURED:
        return str(node_id)
    count = sum(item.node_id == UNCONFIGURED for item in found.values())
    return f"{LSS}{count + 1}" if count else LSS
