r"""Lines of CSV: the columns of python-can, and those of `canmon dump --csv`.

python-can does not tell who sent a frame. Here a `>` behind its data, which base64
does not have and python-can passes over, says that this program did.

>>> csv_row(Heard(1_500_000, "can0", CanFrame(0x705, b"\x7f"), sent=True))
'1.500000,0x705,0,0,0,1,fw==>'
"""

from __future__ import annotations

import re
from binascii import a2b_base64, b2a_base64
from typing import Final

from tickrig.host.monitor.frames.heard import Heard
from tickrig.host.monitor.logs.log_time import to_us
from tickrig.host.monitor.logs.reading.frame_notation import parse_frame
from tickrig.host.monitor.logs.tally import SERIAL_LINES, Tally
from tickrig.wire.can import CanFrame
from tickrig.wire.can_error import ERROR_CLASS_MASK, ErrorFrame
from tickrig.wire.errors import WireError

LOG_HEADER: Final = "timestamp,arbitration_id,extended,remote,error,dlc,data"
DUMP_HEADER: Final = "t,ch,id,dir,dlc,data,kind,node,text"
UNNAMED: Final = "can0"
"""What a bus without a name or number is called."""

SENT: Final = ">"
_DUMPED: Final = re.compile(
    r"([0-9]{1,12}\.[0-9]{6}),([^,\"\s]{1,32}),([0-9A-Fa-f]*),([rt]x),[0-9]+,"
    r"(R[0-8]?|[0-9A-Fa-f]*),.*"
)


def csv_row(heard: Heard) -> str:
    """Write a frame below `LOG_HEADER`."""
    at_us, _, frame, sent = heard
    if isinstance(frame, ErrorFrame):
        what = f"{frame.error_class:#x},0,0,1,{len(frame.data)}"
    else:
        what = f"{frame.can_id:#x},{frame.extended:d},{frame.remote:d},0,{frame.dlc}"
    data = b2a_base64(frame.data, newline=False).decode("ascii")
    return f"{at_us // 1_000_000}.{at_us % 1_000_000:06d},{what},{data}{SENT * sent}"


def parse_csv_line(text: str, tally: Tally) -> Heard | str | None:
    """Return a frame, the name of a header or of what was counted instead, or None."""
    if text.startswith((LOG_HEADER, DUMP_HEADER)):
        return text
    try:
        if match := _DUMPED.fullmatch(text):
            return _dumped(match, tally)
        return _logged(text.split(","))
    except (ValueError, WireError):
        return None


def _dumped(match: re.Match[str], tally: Tally) -> Heard | str:
    stamp, channel, ident, direction, data = match.groups()
    if not ident:
        tally.passed_over[SERIAL_LINES] += 1
        return SERIAL_LINES
    return Heard(to_us(float(stamp)), channel, parse_frame(f"{ident}#{data}"), direction == "tx")


def _logged(cells: list[str]) -> Heard:
    stamp, ident, extended, remote, error, dlc, text = cells
    data, can_id, length = a2b_base64(text), int(ident, 16), int(dlc)
    frame: CanFrame | ErrorFrame
    if error == "1":
        frame = ErrorFrame(can_id & ERROR_CLASS_MASK, data[:8].ljust(8, b"\0"))
    elif remote == "1":
        frame = CanFrame(can_id, b"", True, extended == "1", length).checked()
    else:
        frame = CanFrame(can_id, data, False, extended == "1").checked()
    return Heard(to_us(float(stamp)), UNNAMED, frame, text.rstrip().endswith(SENT))
