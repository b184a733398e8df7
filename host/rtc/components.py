"""Example components, after those that come with OpenRTM-aist."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Mapping
from typing import Any, ClassVar, Final

from tickrig.host.rtc.component import ExecutionContext, ModuleSpec, RtComponent
from tickrig.host.rtc.ports.data_port import InPort, OutPort
from tickrig.host.rtc.states import ReturnCode
from tickrig.wire.rtc_types import rtc
from tickrig.wire.rtc_types.idl import Struct
from tickrig.wire.rtc_types.rtc import Time, TimedLong

_LOW: Final = -(2**31)
_HIGH: Final = 2**31 - 1
"""Least and greatest number that ConsoleIn accepts."""

_LENGTH: Final = 10
"""Number of elements of a sequence that SeqOut writes."""

_COUNTED: Final[Mapping[str, Callable[[int], float]]] = {
    "Octet": lambda n: n & 0xFF,
    "Short": lambda n: n & 0x7FFF,
    "Long": lambda n: n,
    "Float": lambda n: (n & 0x7FFF) / 4,
    "Double": lambda n: n / 4,
}
"""Values that SeqOut writes in period n, by the name of the port."""

_SEQ_PORTS: Final[Mapping[str, Any]] = {
    name + seq: getattr(rtc, f"Timed{name}{seq}") for seq in ("", "Seq") for name in _COUNTED
}
"""Types of the ports of SeqIn and SeqOut by name, in the order of OpenRTM's SeqIn."""


class ConsoleIn(RtComponent):
    """Example component that writes the user's numbers to its OutPort `out`, one per period.

    The component of the same name in OpenRTM blocks until the user has typed a number. This
    component does not block: the program that reads the console calls `enter` or `typed` instead.

    Attributes:
        waiting: numbers that were entered and not yet written.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("ConsoleIn", "Console input component")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.out = self.add_port(OutPort("out", TimedLong))
        self.waiting: deque[int] = deque()

    def enter(self, *numbers: int) -> None:
        """Enter numbers in the range -2**31..2**31-1."""
        self.waiting.extend(numbers)

    def typed(self, line: str) -> None:
        """Enter a number that the user typed as text.

        Raises:
            ValueError: the text is not a number in the range -2**31..2**31-1.
        """
        try:
            number = int(line)
        except ValueError:
            number = _HIGH + 1
        if not _LOW <= number <= _HIGH:
            raise ValueError(f"{line!r} is not a number in {_LOW}..{_HIGH}")
        self.enter(number)

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Write the oldest number that was entered."""
        if self.waiting:
            self.out.write(TimedLong(Time.from_us(ec.now_us), self.waiting.popleft()))
        return ReturnCode.RTC_OK


class ConsoleOut(RtComponent):
    """Example component that displays each number that arrives at its InPort `in`.

    Attributes:
        received: all numbers that arrived, in order.
        show: function that is called with each number to display it, or None. The program that owns
            the console sets this function.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("ConsoleOut", "Console output component")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.in_ = self.add_port(InPort("in", TimedLong))
        self.received: list[TimedLong] = []
        self.show: Callable[[TimedLong], None] | None = None

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Show the values that arrived."""
        while self.in_.is_new and (value := self.in_.read()) is not None:
            self.received.append(value)
            if self.show is not None:
                self.show(value)
        return ReturnCode.RTC_OK


class SeqIn(RtComponent):
    """Example component that has InPorts of ten types and keeps the latest value of each.

    The component of the same name in OpenRTM displays the values instead.

    Attributes:
        ins: InPorts by name, such as `Long` and `LongSeq`.
        latest: latest values by the name of their port.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("SeqIn", "Sequence InPort component")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.ins = {name: self.add_port(InPort(name, kind)) for name, kind in _SEQ_PORTS.items()}
        self.latest: dict[str, Struct] = {}

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Read the values that arrived."""
        for name, port in self.ins.items():
            while port.is_new and (value := port.read()) is not None:
                self.latest[name] = value
        return ReturnCode.RTC_OK


class SeqOut(RtComponent):
    """Example component that has OutPorts of ten types and writes counted values to them.

    The values increase in each period. The component of the same name in OpenRTM writes random
    values.

    Attributes:
        outs: OutPorts by name, such as `Long` and `LongSeq`.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("SeqOut", "Sequence OutPort component")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.outs = {name: self.add_port(OutPort(name, kind)) for name, kind in _SEQ_PORTS.items()}
        self._count = 0

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Count from 0 again."""
        self._count = 0
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Write the next values."""
        now = Time.from_us(ec.now_us)
        for name, port in self.outs.items():
            counted = _COUNTED[name.removesuffix("Seq")]
            data: Any = tuple(counted(n) for n in range(self._count, self._count + _LENGTH))
            if name in _COUNTED:
                data = data[0]
            elif name == "OctetSeq":
                data = bytes(data)
            port.write(port.data_type(now, data))
        self._count += 1
        return ReturnCode.RTC_OK


class ConfigSample(RtComponent):
    """Example component with unused configuration parameters, named as in OpenRTM."""

    spec: ClassVar[ModuleSpec] = ModuleSpec("ConfigSample", "Configuration example component")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.int_param0 = bind("int_param0", 0, "0<=x<=150", widget="slider.10")
        self.int_param1 = bind("int_param1", 1, "0<=x<=1000", widget="spin.10")
        self.double_param0 = bind("double_param0", 0.11, "0<=x<=10", widget="slider.1")
        self.double_param1 = bind("double_param1", 9.9, "0<=x<=10", widget="spin.1")
        self.str_param0 = bind("str_param0", "dara", widget="radio")
        self.str_param1 = bind("str_param1", "hoge", "(hoge, fuga, foo)", widget="radio")
        vector: tuple[float, ...] = (0.0, 1.0, 2.0, 3.0, 4.0)
        self.vector_param0 = bind("vector_param0", vector, widget="text")


EXAMPLES: tuple[type[RtComponent], ...] = (ConsoleIn, ConsoleOut, SeqIn, SeqOut, ConfigSample)
