r"""Lines with the escape sequences of colours, as graphs have them, with styles instead.

>>> colour_line("━ \x1b[36mspeed\x1b[0m 3")
(('━ ', ''), ('speed', 'cyan'), (' 3', ''))
"""

from __future__ import annotations

import re
from typing import Final

from tickrig.host.tui.line import Line

COLOURS: Final = {
    "31": "red",
    "32": "green",
    "33": "yellow",
    "34": "blue",
    "35": "magenta",
    "36": "cyan",
}
_CODE: Final = re.compile("\x1b\\[([0-9]*)m")


def colour_line(text: str) -> Line:
    """Return the line; a colour lasts until the next code."""
    pieces = _CODE.split(text)
    codes = ("", *pieces[1::2])
    found = zip(pieces[::2], codes, strict=True)
    return tuple((part, COLOURS.get(code, "")) for part, code in found if part)
