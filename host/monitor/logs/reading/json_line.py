"""One line of JSON, as `canmon dump --jsonl` writes it.

A frame is an object with `v`, `t` (seconds), `ch`, `id`, `x` (1: extended), `dir`
and `data` (hex); a remote frame has `rtr`, its length, and an error frame has
`err`: 1 and its class as `id`. `{"v":1,"ev":"drop","n":12}` says what was lost; a line
of a serial port is an event, too.
"""

from __future__ import annotations

from typing import Any, Final

from tickrig.host.monitor.frames.heard import Heard
from tickrig.host.monitor.logs.log_time import to_us
from tickrig.host.monitor.logs.tally import SERIAL_LINES, Tally
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ErrorFrame
from tickrig.wire.errors import WireError

VERSION: Final = 1
LINE_EVENT: Final = "line"
"""A line of a serial port, which no log of CAN holds."""


def json_line(heard: Heard, more: str = "") -> str:
    """Write a frame; `more` are further members, each with its comma in front.

    >>> json_line(Heard(1_500_000, "can0", CanFrame(0x185, b"7")))
    '{"v":1,"t":1.500000,"ch":"can0","id":389,"x":0,"dir":"rx","data":"37"}'
    """
    at_us, channel, frame, sent = heard
    if isinstance(frame, ErrorFrame):
        what = f'"id":{frame.error_class},"x":0,"err":1'
    else:
        remote = f',"rtr":{frame.dlc}' if frame.remote else ""
        what = f'"id":{frame.can_id},"x":{frame.extended:d}{remote}'
    return (
        f'{{"v":{VERSION},"t":{at_us // 1_000_000}.{at_us % 1_000_000:06d},"ch":{_quoted(channel)},'
        f'{what},"dir":"{"tx" if sent else "rx"}","data":"{frame.data.hex().upper()}"{more}}}'
    )


def drop_line(lost: int) -> str:
    """Write that frames were lost.

    >>> drop_line(12)
    '{"v":1,"ev":"drop","n":12}'
    """
    return f'{{"v":{VERSION},"ev":"drop","n":{lost}}}'


def parse_json_line(text: str, tally: Tally) -> Heard | str | None:
    """Return a frame, the name of an event, or None for anything else."""
    import json  # noqa: PLC0415 - candump's lines are the usual ones

    try:
        said = json.loads(text)
        if "ev" in said:
            return _event(said, tally)
        return Heard(to_us(said["t"]), _name(said["ch"]), _frame(said), said.get("dir") == "tx")
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError, WireError):
        return None


def _event(said: dict[str, Any], tally: Tally) -> str:
    """Take an event; one that is not known says nothing to us."""
    if said["ev"] == "drop":
        tally.lost += max(0, int(said["n"]))
    elif said["ev"] == LINE_EVENT:
        tally.passed_over[SERIAL_LINES] += 1
    return str(said["ev"])


def _name(channel: object) -> str:
    name = str(channel)
    if name.split() != [name]:
        raise ValueError(f"channel {name!r} is not a name without blanks")
    return name


def _frame(said: dict[str, Any]) -> CanFrame | ErrorFrame:
    data = bytes.fromhex(said["data"])
    if said.get("err"):
        return ErrorFrame(int(said["id"]) & 0x1FFF_FFFF, data[:8].ljust(8, b"\0"))
    remote = said.get("rtr")
    frame = CanFrame(int(said["id"]), data, remote is not None, bool(said["x"]), int(remote or 0))
    return frame.checked()


def _quoted(text: str) -> str:
    """Quote a name; nearly all need no care."""
    if text.isascii() and text.isprintable() and '"' not in text and "\\" not in text:
        return f'"{text}"'
    import json  # noqa: PLC0415 - slow

    return json.dumps(text)
