"""Lines of a serial port as `canmon dump` shows them, beside frames.

>>> from tickrig.host.monitor.decode.decoded import Decoded
>>> from tickrig.host.monitor.decode.serial.heard_line import HeardLine
>>> line = HeardLine(1_500_000, "ttyS0", False, b"EV:PowerOn", Decoded("rrc", None, "event"))
>>> line_text(line, "rrc event")
'ttyS0  <  EV:PowerOn                     rrc event'
>>> line_json(line)
'{"v":1,"ev":"line","t":1.500000,"ch":"ttyS0","dir":"rx","data":"45563A506F7765724F6E"}'
"""

from __future__ import annotations

import json
from typing import TYPE_CHECKING

from tickrig.host.monitor.frames.dump_line import DATA_WIDTH
from tickrig.host.monitor.logs.reading.json_line import LINE_EVENT, VERSION
from tickrig.host.monitor.traffic.line_traffic import ARROWS

if TYPE_CHECKING:
    from tickrig.host.monitor.decode.serial.heard_line import HeardLine


def line_text(line: HeardLine, text: str) -> str:
    """Write the line, with what it means behind it."""
    data = bytes_text(line.data)
    shown = f"{data:<{DATA_WIDTH}}   {text}" if text else data
    return f"{line.channel}  {ARROWS[line.sent]}  {shown}"


def line_json(line: HeardLine, more: str = "") -> str:
    """Write an event in JSON; `more` are further members, each with its comma in front."""
    at_us = line.at_us
    return (
        f'{{"v":{VERSION},"ev":"{LINE_EVENT}","t":{at_us // 1_000_000}.{at_us % 1_000_000:06d},'
        f'"ch":{json.dumps(line.channel)},"dir":"{"tx" if line.sent else "rx"}",'
        f'"data":"{line.data.hex().upper()}"{more}}}'
    )


def bytes_text(data: bytes) -> str:
    r"""Write bytes as text where they are all printable, else in hex.

    >>> bytes_text(b"SA:64"), bytes_text(b"\x01A")
    ('SA:64', '01 41')
    """
    text = data.decode("latin-1")
    return text if text.isascii() and text.isprintable() else data.hex(" ").upper()
