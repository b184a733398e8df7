"""Signals of a node: objects and physical inputs by name."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import partial
from typing import Final, Protocol

from tickrig.device.canopen.dictionary import Dictionary, Entry, SdoAbort
from tickrig.device.canopen.slave import CanopenSlave
from tickrig.device.physical import InputSignal, QuantityBank, SignalType
from tickrig.host.text.values import Setting
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.object_table import Access, ObjectCode
from tickrig.wire.errors import FieldError

# Named signals of a CANopen node: dictionary entries and physical inputs, set without the bus.

_HEX: Final = "hex:"
"""Prefix of the bytes of an octet string, a time or a domain."""

_REAL32_MAX: Final = 3.4028234663852886e38
_REAL64_MAX: Final = 1.7976931348623157e308

_NAME: Final = re.compile(r"0x([0-9A-Fa-f]{4})(?::([0-9]{1,3}|0x[0-9A-Fa-f]{1,2}))?")
_FRACTIONS: Final = (DataType.REAL32, DataType.REAL64)
_TEXTS: Final = (DataType.VISIBLE_STRING, DataType.UNICODE_STRING, DataType.VISIBLE_CHAR)


class NodeSignal(Protocol):
    """A named value of a device that can be read and set between ticks."""

    @property
    def item(self) -> InputSignal:
        """Description of the signal."""
        ...

    def read(self) -> Setting:
        """Return the present value."""
        ...

    def check(self, value: Setting) -> Setting:
        """Return the value that `write` would set; raise ValueError if it is not accepted."""
        ...

    def write(self, value: Setting) -> None:
        """Set the value."""


def object_name(dictionary: Dictionary, entry: Entry) -> str:
    """Return the name of an object in panels and scenarios, such as `0x6000:1`.

    The number after the colon is the sub-index in decimal. A variable has no sub-index in its name,
    as in `0x1017`.
    """
    name = f"0x{entry.index:04X}"
    code = dictionary.objects[entry.index].code
    plain = code in (ObjectCode.VAR, ObjectCode.DOMAIN) and entry.sub == 0
    return name if plain else f"{name}:{entry.sub}"


def find_object(dictionary: Dictionary, name: str) -> Entry | None:
    """Return the object that a name such as `0x6000:1` means, or None if there is no such object.

    The name `0x6000` without a sub-index means `0x6000:0`.
    """
    match = _NAME.fullmatch(name)
    if match is None:
        return None
    sub = match[2] or "0"
    return dictionary.find(int(match[1], 16), int(sub, 16 if sub.startswith("0x") else 10))


_DeferredCall = Callable[[Callable[[], None]], None]
"""Function that schedules an action for the start of the node's next tick."""


class ObjectSignal:
    """A signal that reads and sets an object of the object dictionary inside the device.

    The bus is not used. Access rights are ignored, except that a constant cannot be changed. If a
    service of the node owns the object, this service checks a new value, and uses the value as if
    it had come from the bus. For example, the heartbeat service uses a new heartbeat time. The
    value changes at the start of the node's next tick.

    Args:
        name: name of the object, as returned by `object_name`.
        entry: the object in the dictionary.
        defer: function that schedules the change.
    """

    def __init__(self, name: str, entry: Entry, defer: _DeferredCall) -> None:
        self._name, self._entry, self._defer = name, entry, defer

    @property
    def item(self) -> InputSignal:
        """Name, type and range; the unit is the data type."""
        entry, data_type = self._entry, self._entry.data_type
        low, high = self._limits()
        shape = SignalType.LEVEL if _is_number(data_type) else SignalType.TEXT
        return InputSignal(
            self._name,
            f"{entry.description.name} ({_access(entry)})",
            shape,
            low,
            high,
            data_type.name,
            real=data_type in _FRACTIONS,
        )

    def read(self) -> Setting:
        """Return the present value: a number, text, or bytes in hex."""
        entry = self._entry
        try:
            value = entry.data_type.decode(entry.present())
        except (SdoAbort, FieldError) as error:
            return f"({error})"
        return _HEX + value.hex() if isinstance(value, bytes) else value

    def check(self, value: Setting) -> Setting:
        """Return the value, or raise ValueError."""
        self._encode(value)
        return value

    def write(self, value: Setting) -> None:
        """Set the value; raise ValueError if the owner of the object refuses the value."""
        entry, data = self._entry, self._encode(value)
        try:
            entry.check_owner(data)
        except SdoAbort as abort:
            raise ValueError(f"{self._name} {value}: refused, {abort}") from None
        self._defer(partial(entry.force, data))

    def _encode(self, value: Setting) -> bytes:
        entry, data_type = self._entry.description, self._entry.data_type
        if Access.CONST in entry.access:
            raise ValueError(f"{self._name} is constant")
        low, high = self._limits()
        if _is_number(data_type) and not isinstance(value, str) and not low <= value <= high:
            raise ValueError(f"{self._name} {value} is not in {low}..{high}")
        try:
            data = data_type.encode(_value(data_type, value))
        except ValueError as error:
            raise ValueError(f"{self._name} {value!r}: {error}") from None
        if not data_type.size and len(data) > entry.max_bytes:
            raise ValueError(f"{self._name} holds {entry.max_bytes} bytes, not {len(data)}")
        return data

    def _limits(self) -> tuple[float, float]:
        """Return the limits of a number, or the limits of its data type."""
        low, high = _range(self._entry.data_type)
        entry = self._entry.description
        return low if entry.low is None else entry.low, high if entry.high is None else entry.high


def _is_number(data_type: DataType) -> bool:
    return data_type.is_integer or data_type in _FRACTIONS


def _access(entry: Entry) -> str:
    if Access.CONST in entry.description.access:
        return "const"
    return {(True, True): "rw", (True, False): "ro", (False, True): "wo"}.get(
        (entry.description.readable, entry.description.writable), "hidden"
    )


def _range(data_type: DataType) -> tuple[float, float]:
    if data_type.is_integer:
        return data_type.limits
    if not _is_number(data_type):
        return 0, 0
    most = _REAL32_MAX if data_type is DataType.REAL32 else _REAL64_MAX
    return -most, most


def _value(data_type: DataType, value: Setting) -> Value:
    """Return the value in the form of the data type; raise FieldError if it does not fit."""
    if data_type in _TEXTS:
        return str(value)
    if _is_number(data_type):
        return value
    text = str(value)
    try:
        if text.startswith(_HEX):
            return bytes.fromhex(text.removeprefix(_HEX))
    except ValueError:
        pass
    raise FieldError(f"{data_type.name} takes bytes, as {_HEX}01ff")


_ERROR_BITS: Final = {0x2: 0x02, 0x3: 0x04, 0x4: 0x08}
"""Bit of the error register by the first digit of an emergency error code (CiA 301)."""

_COMMUNICATION_ERRORS: Final = range(0x8100, 0x8200)


class SwitchSignal:
    """Signal that starts (1) or ends (0) a physical fault of a node, such as a power cut.

    Every node has these signals. See `NodeSignal`.

    Args:
        name: name of the fault.
        text: description as readable text.
        switch: function that is called with the new value.
    """

    def __init__(self, name: str, text: str, switch: Callable[[int], None]) -> None:
        self.item = InputSignal(name, text, SignalType.FAULT)
        self._switch, self._value = switch, 0

    def read(self) -> int:
        """Return 1 while the fault is present."""
        return self._value

    def check(self, value: Setting) -> int:
        """Return the value, or raise ValueError."""
        if not isinstance(value, int) or value not in (0, 1):
            raise ValueError(f"{self.item.name} {value!r} is not in 0..1")
        return int(value)

    def write(self, value: Setting) -> None:
        """Start or clear the fault."""
        self._value = self.check(value)
        self._switch(self._value)


class Emergency:
    """The signal `emergency`: setting it raises an error in the node, which then sends an EMCY.

    The value is the emergency error code. 0 clears the error.

    Args:
        slave: the slave.
        defer: function that schedules the change.
    """

    def __init__(self, slave: CanopenSlave, defer: _DeferredCall) -> None:
        text = "error seen by the application: emergency error code, 0 for none"
        self.item = InputSignal("emergency", text, high=0xFFFF)
        self._slave, self._defer, self._code = slave, defer, 0

    def read(self) -> int:
        """Return the latest code."""
        return self._code

    def check(self, value: Setting) -> int:
        """Return the value, or raise ValueError."""
        if not isinstance(value, int) or not 0 <= value <= 0xFFFF:
            raise ValueError(f"emergency {value!r} is not in 0..65535")
        return value

    def write(self, value: Setting) -> None:
        """Clear the previous error, and raise the new error."""
        old, self._code = self._code, self.check(value)
        if old and old != self._code:
            self._defer(partial(self._slave.emergency_clear, old))
        if code := self._code:
            self._defer(partial(self._slave.emergency, code, _register_bit(code)))


class Quantity:
    """A physical input of the device as a signal, such as a voltage, a load or a blocked shaft.

    Args:
        bank: all physical inputs of the device; the signal is one of them.
        item: description of the input.
        on_change: function that is called after each change.
    """

    def __init__(
        self, bank: QuantityBank, item: InputSignal, on_change: Callable[[], None]
    ) -> None:
        self._bank, self.item, self._on_change = bank, item, on_change

    def read(self) -> float:
        """Return the present value."""
        return self._bank[self.item.name]

    def check(self, value: Setting) -> float:
        """Return the value, or raise ValueError."""
        return self._bank.check(self.item.name, value)

    def write(self, value: Setting) -> None:
        """Set the value, which takes effect in the device's next tick."""
        self._bank.set(self.item.name, value)
        self._on_change()


def _register_bit(code: int) -> int:
    if code in _COMMUNICATION_ERRORS:
        return 0x10
    return _ERROR_BITS.get(code >> 12, 0x01)


OnSet = Callable[[str, Setting], None]
"""Function that is called with the name and value of each set signal."""


class NotedSignal:
    """Wrapper of a signal that calls a function after each change of the wrapped signal.

    A node that has a callback `on_set` wraps its signals in this class, for example to record each
    change in a trace. `NodeSignal` describes the methods.

    Args:
        signal: the wrapped signal.
        note: function that is called after each change, with the name and the new value of the
            signal.
    """

    def __init__(self, signal: NodeSignal, note: OnSet) -> None:
        self._signal, self._note = signal, note

    @property
    def item(self) -> InputSignal:
        """Description of the signal."""
        return self._signal.item

    def read(self) -> Setting:
        """Return the present value."""
        return self._signal.read()

    def check(self, value: Setting) -> Setting:
        """Return the value, or raise ValueError."""
        return self._signal.check(value)

    def write(self, value: Setting) -> None:
        """Set the value."""
        self._signal.write(value)
        self._note(self._signal.item.name, value)
