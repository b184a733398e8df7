"""The ports of SeqIn and SeqOut: a number and a sequence of each of five kinds."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Final

from tickrig.wire.rtc_types.basic import (
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

SEQ_PORTS: Final[Mapping[str, type[Struct]]] = {
    "Octet": TimedOctet,
    "Short": TimedShort,
    "Long": TimedLong,
    "Float": TimedFloat,
    "Double": TimedDouble,
    "OctetSeq": TimedOctetSeq,
    "ShortSeq": TimedShortSeq,
    "LongSeq": TimedLongSeq,
    "FloatSeq": TimedFloatSeq,
    "DoubleSeq": TimedDoubleSeq,
}
"""Type by port name, in the order of OpenRTM's SeqIn."""
