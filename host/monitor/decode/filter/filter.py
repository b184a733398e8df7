"""Filters: which frames are wanted.

```
filter = list | or              list: candump's rules, as 123:7FF,400~700,#FF
or     = and ("or" | ",") ...
and    = not "and" ...
not    = "not" not | "(" or ")" | term
term   = 181 | 181-18F | 18FF0000-18FFFFFF | 123:7FF | 400~700 | #FF
       | nmt | sync | time | emcy | heartbeat | boot-up | guard | lss | error | unmapped | raw
       | pdo | tpdo | rpdo | tpdo1 | sdo | sdo[6040h] | sdo[0x1018:1] | sdo.aborted | sdo.unanswered
       | node = 3 | id < 200 | dlc = 8 | channel = can0 | kind = emcy | dir = tx | src = eds
       | statusword.fault | position > 1000 | 3.position > 1000 | state = stopped
```

Numbers after `id` and bare CAN-IDs are hexadecimal, all others as in Python.

>>> from tickrig.host.monitor.decode.decoded import Decoded
>>> from tickrig.host.monitor.frames.heard import Heard
>>> from tickrig.wire.can import CanFrame
>>> heard = Heard(0, "can0", CanFrame.parse("085#3081110700000000"))
>>> parse_filter("node=5 and (pdo or emcy)").matches(heard, Decoded("emcy", 5))
True
"""

from __future__ import annotations

from dataclasses import dataclass

from tickrig.host.monitor.decode.filter.filter_parser import FilterParser
from tickrig.host.monitor.decode.filter.filter_terms import Test, candump_test
from tickrig.host.monitor.frames.candump_filter import CandumpFilter


@dataclass(frozen=True, slots=True)
class Filter:
    """A filter that was read.

    Attributes:
        text: as it was written.
        matches: says whether a frame is wanted.
        signals: names of the signals it asks for, to tell when none of them ever comes.
    """

    text: str
    matches: Test
    signals: frozenset[str] = frozenset()


def parse_filter(text: str) -> Filter:
    """Read a filter.

    Raises:
        FilterError: it is none; says the column.
    """
    try:
        chosen = CandumpFilter.parse(text)
    except ValueError:
        return Filter(text, *FilterParser(text).parse())
    return Filter(text, candump_test(chosen))
