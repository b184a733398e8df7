r"""Lines with the escape sequence of reverse text, as `top` writes them, with styles instead.

>>> ansi_line("01 \x1b[7mFF\x1b[0m")
(('01 ', ''), ('FF', 'bold yellow'))
"""

from __future__ import annotations

from tickrig.host.canmon.tui.widgets.trace_line import CHANGED
from tickrig.host.monitor.frames.payload_text import PLAIN, REVERSE
from tickrig.host.tui.line import Line


def ansi_line(text: str) -> Line:
    """Return the line; what is reversed there has changed."""
    pieces = []
    for part in text.split(REVERSE):
        marked, found, rest = part.partition(PLAIN)
        pieces += [(marked, CHANGED), (rest, "")] if found else [(part, "")]
    return tuple(piece for piece in pieces if piece[0])
