"""One device of a rig file, made to see what it has; nothing runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

from tickrig.device.canopen.stack import make_slave
from tickrig.device.chance import check_rate
from tickrig.device.physical import SignalType
from tickrig.emulators.bench.operator import WireFault
from tickrig.emulators.can.faults import CAN_FAULTS
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.build import ANY_ID, describe
from tickrig.emulators.canopen.choices import AUTO
from tickrig.emulators.canopen.eds import EdsCache
from tickrig.emulators.canopen.models import MODELS
from tickrig.emulators.canopen.node.node import Node
from tickrig.emulators.canopen.node.nodes import Nodes
from tickrig.emulators.commands.device_config import configure, option_names
from tickrig.emulators.commands.device_type import ConfiguredDevice
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.testing.rig_file.fields import near
from tickrig.emulators.testing.rig_file.plan import DeviceKind, DevicePlan
from tickrig.host.cli.extensions import ExtensionError
from tickrig.host.cli.refused import Refused
from tickrig.host.text.user_file import explain_error


@dataclass(frozen=True, slots=True)
class Probe:
    """What a device has.

    Attributes:
        physical: its inputs and outputs.
        wire_faults: those of its end of the wire, or of its bus.
        title: what it is, for people.
        baud: of a serial device, that of its type.
        node_id: of a node, None if nothing gives one.
        bit_rate: of a node, that of its DCF.
    """

    physical: HasSignals
    wire_faults: Mapping[str, WireFault]
    title: str
    baud: int | None = None
    node_id: int | None = None
    bit_rate: int | None = None

    def check_fault(self, name: str, rate: float | None) -> None:
        """Raise ValueError unless the device, or its wire, can have this fault."""
        own = self.physical.inputs.names(SignalType.FAULT)
        if name in own:
            check_rate(name, rate, rated=False)
        else:
            check_wire_fault(self.wire_faults, name, rate, [*own, *self.wire_faults])


def check_wire_fault(
    faults: Mapping[str, WireFault], name: str, rate: float | None, names: list[str]
) -> None:
    """Raise ValueError unless a wire can have this fault; `names` are those to name then."""
    if name not in faults:
        raise ValueError(f"no fault {name!r}; {near(name, names)}")
    check_rate(name, rate, rated=faults[name].rated)


def probe(plan: DevicePlan, cache: EdsCache, wrong: Callable[..., None]) -> Probe | None:
    """Make a device.

    Args:
        plan: what it is.
        cache: of EDS files.
        wrong: takes a mistake and the keys below the device's table where it stands.

    Returns:
        What it has, None if it cannot be made.
    """
    if plan.kind is DeviceKind.SERIAL:
        made = _configured(plan, wrong)
        if made is None:
            return None
        line = made.type.line
        return Probe(made.device, line.faults, made.type.title, baud=line.baud)
    device = Path(plan.type) if plan.kind is DeviceKind.EDS else plan.type
    try:
        found = describe(cache, device, plan.profile or AUTO)
    except Refused as error:
        for reason in str(error).splitlines():
            wrong(reason, "type")
        return None
    except SystemExit as error:  # a user's file may do anything
        wrong(f"{plan.type}: {explain_error(error)}", "type")
        return None
    node_id = found.node_id if plan.node_id is None else plan.node_id
    slave = make_slave(found.make_dictionary(), node_id or ANY_ID, None, found.application)
    node = Nodes([Node(plan.name, slave, CanWire())])
    title = found.info.product_name or Path(plan.type).name
    if plan.kind is DeviceKind.MODEL:
        title = MODELS[plan.type].text
    return Probe(node, CAN_FAULTS, title, node_id=node_id, bit_rate=found.bit_rate)


def _configured(plan: DevicePlan, wrong: Callable[..., None]) -> ConfiguredDevice | None:
    """Make a device on a serial line; each option that it does not take is told."""
    reasons = {key: _reason(plan.type, key, value) for key, value in plan.config.items()}
    for key, reason in reasons.items():
        if reason:
            wrong(reason, "config", key)
    if any(reasons.values()):
        return None
    if reason := _refusal(plan.type, plan.config):
        wrong(reason, "config" if plan.config else "type")
        return None
    return configure(plan.type, plan.config)


def _reason(name: str, key: str, value: object) -> str:
    """Return why a device cannot have an option, empty if it can."""
    try:
        names = option_names(name)
    except ExtensionError:
        return ""  # the device is the mistake
    if key.replace("_", "-") not in names:
        return f"no option {key!r}; {near(key, list(names))}"
    reason = _refusal(name, {key: value}).removeprefix("Invalid value for ")
    return reason.replace("'", "", 2) if reason.startswith("'--") else reason


def _refusal(name: str, config: Mapping[str, object]) -> str:
    """Return why there can be no such device, empty if there can."""
    try:
        configure(name, config)
    except ValueError as error:
        return str(error)
    except (Exception, SystemExit) as error:  # a foreign type may raise anything
        return explain_error(error)
    return ""
