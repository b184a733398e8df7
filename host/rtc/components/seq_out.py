"""SeqOut: numbers and sequences of all kinds go to OutPorts."""

from __future__ import annotations

from typing import ClassVar, Final

from tickrig.host.rtc.component import ModuleSpec, RtComponent
from tickrig.host.rtc.components.seq_ports import SEQ_PORTS
from tickrig.host.rtc.execution.execution_context import ExecutionContext
from tickrig.host.rtc.execution.states import ReturnCode
from tickrig.host.rtc.ports.data_port import OutPort
from tickrig.wire.rtc_types.basic import (
    Time,
    TimedDouble,
    TimedDoubleSeq,
    TimedFloat,
    TimedFloatSeq,
    TimedLong,
    TimedLongSeq,
    TimedOctet,
    TimedOctetSeq,
    TimedShort,
    TimedShortSeq,
)
from tickrig.wire.rtc_types.idl import Struct

LENGTH: Final = 10
"""Elements of a sequence."""


class SeqOut(RtComponent):
    """Writes a value to each of its ports in each period: counted up, where OpenRTM's are random.

    Attributes:
        outs: its ports by name.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("SeqOut", "Sequence OutPort component")

    def __init__(self, instance_name: str) -> None:
        super().__init__(instance_name)
        self.outs = {name: self.add_port(OutPort(name, kind)) for name, kind in SEQ_PORTS.items()}
        self._count = 0

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Count from 0 again."""
        self._count = 0
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Write the next values."""
        for value in _values(Time.from_us(ec.now_us), self._count):
            self.outs[type(value).__name__.removeprefix("Timed")].write(value)
        self._count += 1
        return ReturnCode.RTC_OK


def _values(tm: Time, n: int) -> tuple[Struct, ...]:
    octets = bytes(k & 0xFF for k in range(n, n + LENGTH))
    shorts = tuple(k & 0x7FFF for k in range(n, n + LENGTH))
    return (
        TimedOctet(tm, octets[0]),
        TimedShort(tm, shorts[0]),
        TimedLong(tm, n),
        TimedFloat(tm, shorts[0] / 4),
        TimedDouble(tm, n / 4),
        TimedOctetSeq(tm, octets),
        TimedShortSeq(tm, shorts),
        TimedLongSeq(tm, tuple(range(n, n + LENGTH))),
        TimedFloatSeq(tm, tuple(k / 4 for k in shorts)),
        TimedDoubleSeq(tm, tuple(k / 4 for k in range(n, n + LENGTH))),
    )
