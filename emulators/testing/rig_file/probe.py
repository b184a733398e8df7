"""Make one device of a rig file to find its inputs, outputs and faults; it does not run."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, Final, Generic, NamedTuple, TypeVar

from tickrig.device.physical import InputSignal, OutputSignal, SignalType
from tickrig.emulators.can.faults import CAN_FAULTS
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen import late
from tickrig.emulators.canopen.choices import AUTO
from tickrig.emulators.canopen.faults import NodeFaults
from tickrig.emulators.canopen.node import Node, NodeSide
from tickrig.emulators.commands.device_type import ConfiguredDevice, configure, option_names
from tickrig.emulators.rig.emulated import HasSignals, read_signal
from tickrig.emulators.rig.faults import FaultForm
from tickrig.emulators.testing.rig_file.keys import check_name
from tickrig.emulators.testing.rig_file.plan import DeviceKind, DevicePlan, MadeDevice
from tickrig.emulators.testing.signals.driver import SLASH, check_signals
from tickrig.emulators.testing.signals.sources import Constant, SignalSpec
from tickrig.emulators.testing.signals.spec_reader import FORMS, read_signal_spec
from tickrig.host.text.names import closest, near
from tickrig.host.text.section import Section, is_broken, shown
from tickrig.host.text.toml_reader import TomlPath
from tickrig.host.text.user_file import explain_error
from tickrig.host.text.values import Setting


@dataclass(frozen=True, slots=True)
class Probe:
    """Properties of a device that are needed to check its settings in a rig file.

    Attributes:
        physical: inputs and outputs of the device.
        wire_faults: faults of the wire to the device. For a CANopen node these are the faults of
            the CAN bus.
        title: name of the device in messages.
        baud: baud rate that the type of a serial device has by default, or None for a CANopen node.
        node_id: node-ID of a CANopen node, from its DCF or model.
        bit_rate: bit rate of a CANopen node, from its DCF.
        start: initial values of inputs by name, only where the device's description gives another
            value than the default of the input.
        made: the device, for use by a bench.
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
    """Return the cache of EDS files that all benches of this process share."""
    return late.EdsCache()


class WrongDevice(NamedTuple):
    """An error in the description of a device, because of which the device cannot be made.

    Attributes:
        reason: text of the error message.
        keys: keys that lead to the error within the device's table in the rig file.
    """

    reason: str
    keys: tuple[str, ...]


def probe(plan: DevicePlan, seed: int = 0) -> Probe | list[WrongDevice]:
    """Make a device of a rig file, in order to find errors in the file before it is used.

    Args:
        plan: description of the device in the rig file.
        seed: seed of all random numbers, for a device on a serial line.

    Returns:
        The properties of the device, or all errors in its description.
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
        plan.sdo or late.USUAL,
    )
    node = NodeSide(Node(plan.name, slave, CanWire()))
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
    """Return why a device cannot have an option, or "" if it can."""
    try:
        names = option_names(name)
    except ValueError:
        return ""  # the device is the mistake
    if key.replace("_", "-") not in names:
        return f"no option {key!r}; {near(key, list(names))}"
    made = _configured(name, {key: value})
    return "" if isinstance(made, ConfiguredDevice) else made


def _configured(name: str, config: Mapping[str, object], seed: int = 0) -> ConfiguredDevice | str:
    """Return the device with the options, or the reason why it cannot be made."""
    try:
        return configure(name, config, seed)
    except ValueError as error:
        return str(error)
    except (Exception, SystemExit) as error:  # a foreign type may raise anything
        return explain_error(error)


# What stands in for a device that cannot be made: it has every name, and takes every value.

_T = TypeVar("_T")


class _Everything(Mapping[str, _T], Generic[_T]):
    """A table that has every name, with the same value for each name."""

    def __init__(self, item: _T) -> None:
        self._item = item

    def __getitem__(self, name: str) -> _T:
        return self._item

    def __contains__(self, name: object) -> bool:
        return True

    def __iter__(self) -> Iterator[str]:
        return iter(())

    def __len__(self) -> int:
        return 0


_ANY: Final = InputSignal("any", "", low=float("-inf"), high=float("inf"), real=True)


class _UnknownInputs:
    """Inputs that accept every name and value."""

    changed = False
    table: Mapping[str, InputSignal] = _Everything(_ANY)
    groups: Mapping[str, tuple[str, ...]] = {}

    def __getitem__(self, name: str) -> Setting:
        """Return a placeholder."""
        return 0

    def set(self, name: str, value: Setting) -> None:
        """Accept a value."""

    def check(self, name: str, value: Setting) -> Setting:
        """Return the value."""
        return value

    def names(self, signal_type: SignalType) -> tuple[str, ...]:
        """Return no names: every name is accepted."""
        return ()

    def find(self, name: str, signal_type: SignalType | None = None) -> InputSignal:
        """Return a placeholder with this name."""
        return self.table[name]


class _UnknownDevice:
    """Replaces a device that cannot be made, so that no further errors are reported."""

    tick_us = 1_000
    inputs = _UnknownInputs()
    outputs: Mapping[str, OutputSignal] = _Everything(OutputSignal("any", ""))

    def read(self, name: str, /) -> Setting:
        """Return a placeholder."""
        return 0


UNKNOWN: Final = _UnknownDevice()


# `[device.NAME.start]` and `[signal.NAME]`: inputs at the start, and what drives them.
#
# `[safe.NAME]`: outputs at the end.

_OBJECT: Final = "0x"
"""Beginning of the names of objects of a node."""

Start = dict[str, Setting | SignalSpec]

_UNREAD = SignalSpec(Constant(0.0))
"""Replacement of a signal that cannot be read, so that formulas find its name."""


class StartReader:
    """Reads from a rig file the initial values of inputs and the signals that drive inputs.

    All tables with such values are checked together, because a formula in one table may name
    signals of another table.

    Args:
        folder: folder of the files with tables of values.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._signals: dict[str, SignalSpec] = {}
        self._places: dict[str, tuple[Section, TomlPath]] = {}

    def read_signals(self, section: Section) -> dict[str, SignalSpec]:
        """Read `[signal]`."""
        for name, value in section.values.items():
            try:
                check_name(name)
            except ValueError as error:
                section.wrong(str(error), name)
            self._keep(
                name, self._spec(section, (name,), value) or _UNREAD, section, (name,), value
            )
        return dict(self._signals)

    def read_start(self, device: str, section: Section, physical: HasSignals) -> Start:
        """Read the table of a rig file with the initial inputs of a device.

        Args:
            device: name of the device.
            section: table with the initial inputs.
            physical: inputs and outputs of the device.

        Returns:
            Initial values or signals, by name of the input.
        """
        start: Start = {}
        names: list[str] = []  # a node has many objects
        if physical is UNKNOWN:
            section = replace(section, values=_without_lists(section.values))
        for keys, name, value in self._inputs(section, physical.inputs.groups):
            if name in start:
                section.wrong(f"{name} is given twice", *keys)
            elif name not in (table := physical.inputs.table):
                names = names or [*physical.inputs.groups, *table]
                if name in physical.outputs:
                    section.wrong(f"{name} is an output: it can be read, not set", *keys)
                    continue
                section.wrong(f"no input {shown(name)}; {near(name, _alike(name, names))}", *keys)
            elif (found := self._value(section, keys, value, f"{device}{SLASH}{name}")) is not None:
                start[name] = found
                if not isinstance(found, SignalSpec):
                    _check(section, keys, physical, name, found)
        return start

    def check(self, devices: Mapping[str, HasSignals]) -> None:
        """Record the errors of all signals together: unknown names, ranges, circular references."""
        for mistake in check_signals(self._signals, devices):
            section, keys = self._places[str(mistake.keys[0])]
            section.wrong(mistake.reason, *keys)

    def _inputs(
        self, section: Section, groups: Mapping[str, tuple[str, ...]]
    ) -> Iterator[tuple[TomlPath, str, Any]]:
        """Yield each input with the keys of its value; a group yields several inputs."""
        for name, value in section.values.items():
            members = groups.get(name)
            if members is None:
                yield (name,), name, value
            elif isinstance(value, list) and len(value) == len(members):
                for at, (member, each) in enumerate(zip(members, value, strict=True)):
                    yield (name, at), member, each
            elif not is_broken(value):
                wanted = f"[{', '.join(members)}]"
                came = f"{len(value)} values" if isinstance(value, list) else shown(value)
                section.wrong(f"it takes {wanted}, not {came}", name)

    def _value(
        self, section: Section, keys: TomlPath, value: Any, full: str
    ) -> Setting | SignalSpec | None:
        """Return a value, or a signal (checked later), or None if an error was recorded."""
        if isinstance(value, bool | int | float | str):
            return int(value) if isinstance(value, bool) else value
        spec = self._spec(section, keys, value)
        if spec is not None:
            self._keep(full, spec, section, keys, value)
        return spec

    def _keep(
        self, name: str, spec: SignalSpec, section: Section, keys: TomlPath, value: Any
    ) -> None:
        """Store a signal with the key that defines its form."""
        form = [key for key in FORMS if isinstance(value, dict) and key in value]
        self._signals[name], self._places[name] = spec, (section, (*keys, *form[:1]))

    def _spec(self, section: Section, keys: TomlPath, value: Any) -> SignalSpec | None:
        if is_broken(value):
            return None
        spec = read_signal_spec(value, keys, self._folder)
        if isinstance(spec, SignalSpec):
            return spec
        depth = len(keys)
        misspelt = [str(each[depth]) for each, _ in spec if each[depth:] and each[depth] in value]
        for mistake in spec:
            missing = mistake.keys[depth:]
            if not (missing and missing[0] not in value and closest(str(missing[0]), misspelt)):
                section.wrong(mistake.reason, *mistake.keys)
        return None


def read_safe(section: Section, devices: Mapping[str, HasSignals]) -> dict[str, dict[str, Setting]]:
    """Read the table `[safe]` of a rig file: values that outputs must have at the end of a test.

    Args:
        section: table `[safe]`.
        devices: inputs and outputs of the devices, by name of the device.

    Returns:
        The values by device and output.
    """
    safe: dict[str, dict[str, Setting]] = {}
    for device, table in section.subs():
        if device not in devices:
            section.unknown(f"no device {device!r}; {near(device, devices)}", device)
        elif table is not None:
            physical = devices[device]
            safe[device] = {
                name: int(value) if isinstance(value, bool) else value
                for name, value in table.values.items()
                if _can_be_safe(table, physical, name)
            }
    return safe


def _can_be_safe(section: Section, physical: HasSignals, name: str) -> bool:
    """Return whether an output or input can have the value; record the error if not."""
    value = section.values[name]
    if is_broken(value):
        return False
    if name not in physical.outputs and name not in physical.inputs.table:
        names = [*physical.outputs, *physical.inputs.table]
        section.wrong(f"no output {shown(name)}; {near(name, _alike(name, names))}", name)
        return False
    if not isinstance(value, bool | int | float | str):
        section.wrong(f"it takes a number or a text, not {shown(value)}", name)
        return False
    is_text = isinstance(read_signal(physical, name), str)
    if physical is not UNKNOWN and is_text != isinstance(value, str):
        section.wrong(f"it is a {'text' if is_text else 'number'}, not {shown(value)}", name)
        return False
    return True


def _alike(name: str, names: Iterable[str]) -> list[str]:
    """Return names to suggest: objects only if an object is meant, with an equal beginning."""
    if name.startswith(_OBJECT):
        return [each for each in names if each.startswith(name[:4])]
    return [each for each in names if not each.startswith(_OBJECT)]


def _without_lists(values: Mapping[str, Any]) -> dict[str, Any]:
    """Return all values except lists, which may be groups."""
    return {name: value for name, value in values.items() if not isinstance(value, list)}


def _check(
    section: Section, keys: TomlPath, physical: HasSignals, name: str, value: Setting
) -> None:
    try:
        physical.inputs.check(name, value)
    except ValueError as error:
        section.wrong(str(error), *keys)
