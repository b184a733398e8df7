"""One device of a rig file, made to see what it has; nothing runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Final, Generic, NamedTuple, TypeVar

from tickrig.device.physical import InputSignal, OutputSignal, SignalType
from tickrig.emulators.can.faults import CAN_FAULTS
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen import late
from tickrig.emulators.canopen.choices import AUTO
from tickrig.emulators.canopen.faults import NodeFaults
from tickrig.emulators.canopen.node import Node, Nodes
from tickrig.emulators.commands.device_type import ConfiguredDevice, configure, option_names
from tickrig.emulators.rig.emulated import HasSignals
from tickrig.emulators.rig.faults import FaultForm
from tickrig.emulators.testing.rig_file.plan import DeviceKind, DevicePlan, MadeDevice
from tickrig.host.text.names import near
from tickrig.host.text.user_file import explain_error
from tickrig.host.text.values import Setting


@dataclass(frozen=True, slots=True)
class Probe:
    """What a device has.

    Attributes:
        physical: its inputs and outputs.
        wire_faults: those of its end of the wire, or of its bus.
        title: what it is, for people.
        baud: of a serial device, that of its type.
        node_id: of a node, that of its DCF or model.
        bit_rate: of a node, that of its DCF.
        start: inputs that are not as usual when it begins.
        made: the device, for a bench.
    """

    physical: HasSignals
    wire_faults: Mapping[str, FaultForm]
    title: str
    baud: int | None = None
    node_id: int | None = None
    bit_rate: int | None = None
    start: Mapping[str, Setting] = field(default_factory=dict)
    made: MadeDevice = field(default_factory=MadeDevice)

    @property
    def faults(self) -> dict[str, FaultForm]:
        """The faults of the device and of its wire."""
        table, names = self.physical.inputs.table, self.physical.inputs.names(SignalType.FAULT)
        own = {name: FaultForm(table[name].text, rated=False) for name in names}
        return {**self.wire_faults, **own}


@cache
def eds_cache() -> late.EdsCache:
    """Return the descriptions that this process has read: benches come and go."""
    return late.EdsCache()


class WrongDevice(NamedTuple):
    """Why a device cannot be made.

    Attributes:
        reason: for people.
        keys: below its table.
    """

    reason: str
    keys: tuple[str, ...]


def probe(plan: DevicePlan, seed: int = 0) -> Probe | list[WrongDevice]:
    """Make a device.

    Args:
        plan: what it is.
        seed: of all chance in it, for a device on a serial line.

    Returns:
        What it has, or all that is wrong.
    """
    if plan.kind is DeviceKind.SERIAL:
        return _serial(plan, seed)
    device = Path(plan.type) if plan.kind is DeviceKind.EDS else plan.type
    try:
        found = late.describe(eds_cache(), device, plan.profile or AUTO)
    except ValueError as error:
        return [WrongDevice(reason, ("type",)) for reason in str(error).splitlines()]
    except SystemExit as error:  # a user's file may do anything
        return [WrongDevice(f"{plan.type}: {explain_error(error)}", ("type",))]
    node_id = found.node_id if plan.node_id is None else plan.node_id
    slave = late.make_slave(
        found.make_dictionary(),
        late.ANY_ID if node_id is None else node_id,
        None,
        found.application,
        plan.sdo,
    )
    node = Nodes([Node(plan.name, slave, CanWire())])
    title = found.info.product_name or Path(plan.type).name
    if plan.kind is DeviceKind.MODEL:
        title = late.MODELS[plan.type].text
    return Probe(
        node,
        {**CAN_FAULTS, **NodeFaults.fault_types},
        title,
        node_id=found.node_id,
        bit_rate=found.bit_rate,
        start=found.start,
        made=MadeDevice(None if plan.store or node_id is None else slave, plan.made_of()),
    )


def _serial(plan: DevicePlan, seed: int) -> Probe | list[WrongDevice]:
    """Make a device on a serial line."""
    name, config = plan.type, plan.config
    made = _configured(name, config, seed)
    if isinstance(made, ConfiguredDevice):
        line = made.type.line
        return Probe(
            made.device,
            line.faults,
            made.type.title,
            baud=line.baud,
            made=MadeDevice(made, plan.made_of(seed)),
        )
    alone = [(key, _reason(name, key, value)) for key, value in config.items()]
    wrong = [WrongDevice(reason, ("config", key)) for key, reason in alone if reason]
    return wrong or [WrongDevice(made, ("config" if config else "type",))]


def _reason(name: str, key: str, value: object) -> str:
    """Return why a device cannot have an option, empty if it can."""
    try:
        names = option_names(name)
    except ValueError:
        return ""  # the device is the mistake
    if key.replace("_", "-") not in names:
        return f"no option {key!r}; {near(key, list(names))}"
    made = _configured(name, {key: value})
    return "" if isinstance(made, ConfiguredDevice) else made


def _configured(name: str, config: Mapping[str, object], seed: int = 0) -> ConfiguredDevice | str:
    """Return the device of these options, or why there can be none."""
    try:
        return configure(name, config, seed)
    except ValueError as error:
        return str(error)
    except (Exception, SystemExit) as error:  # a foreign type may raise anything
        return explain_error(error)


# What stands in for a device that cannot be made: it has every name, and takes every value.

T = TypeVar("T")


class _Everything(Mapping[str, T], Generic[T]):
    """A table that has every name, with the same behind it."""

    def __init__(self, item: T) -> None:
        self._item = item

    def __getitem__(self, name: str) -> T:
        return self._item

    def __contains__(self, name: object) -> bool:
        return True

    def __iter__(self) -> Iterator[str]:
        return iter(())

    def __len__(self) -> int:
        return 0


_ANY: Final = InputSignal("any", "", low=float("-inf"), high=float("inf"), real=True)


class _UnknownInputs:
    """Inputs that take everything."""

    changed = False
    table: Mapping[str, InputSignal] = _Everything(_ANY)
    groups: Mapping[str, tuple[str, ...]] = {}

    def __getitem__(self, name: str) -> Setting:
        """Return nothing of interest."""
        return 0

    def set(self, name: str, value: Setting) -> None:
        """Take a value."""

    def check(self, name: str, value: Setting) -> Setting:
        """Return the value."""
        return value

    def names(self, signal_type: SignalType) -> tuple[str, ...]:
        """Return nothing: it has all."""
        return ()

    def find(self, name: str, signal_type: SignalType | None = None) -> InputSignal:
        """Return something of this name."""
        return self.table[name]


class _UnknownDevice:
    """Stands in for a device that cannot be made: that is told, and nothing more about it."""

    tick_us = 1_000
    inputs = _UnknownInputs()
    outputs: Mapping[str, OutputSignal] = _Everything(OutputSignal("any", ""))

    def read(self, name: str, /) -> Setting:
        """Return nothing of interest."""
        return 0


UNKNOWN: Final = _UnknownDevice()
