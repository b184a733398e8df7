r"""Times, sizes and texts of others for pages, terminals and JSON.

>>> duration(3_100), duration(2_000_000), duration(200_000_000)
('3.1 ms', '2.00 s', '3 min 20 s')
>>> harmless("a\x1b[31m\u202eb\ud800")
'a␛[31m<U+202E>b<U+D800>'
"""

from __future__ import annotations

import json
import re
from typing import Any, Final

from tickrig.host.text.values import format_time

DASH: Final = "\N{EN DASH}"
"""Placeholder for a missing value."""

_MARKS: Final = (
    "\x80-\x9f\u061c\u200b-\u200f\u2028-\u202e\u2060-\u2069\ufeff\ufff9-\ufffb"
    "\ufffe\uffff\ud800-\udfff"
)
_UNSEEN: Final = re.compile(f"[\x00-\x08\x0b-\x1f\x7f{_MARKS}]")
_NO_CELL: Final = re.compile(f"[\x00-\x1f\x7f{_MARKS}]")


def harmless(value: Any) -> Any:  # a template prints values of any type
    """Make control characters and direction marks in a text visible."""
    if type(value) is not str or (value.isascii() and value.isprintable()):
        return value
    return _UNSEEN.sub(_shown, value.replace("\r\n", "\n"))


def one_line(value: str) -> str:
    r"""Return a text in one line, with visible control characters.

    >>> one_line("a\nFAIL b")
    'a␊FAIL b'
    """
    if value.isascii() and value.isprintable():
        return value
    return str(harmless(value)).replace("\n", "␊").replace("\t", "␉")


def in_cells(text: str) -> str:
    r"""Return a text of the same length in one line, with only printable characters.

    >>> in_cells("a\x1b[31m\u202eb\n")
    'a␛[31m\ufffdb␊'
    """
    if text.isprintable():
        return text
    return _NO_CELL.sub(lambda match: shown if len(shown := _shown(match)) == 1 else "�", text)


def json_text(value: object, *, compact: bool = False, letters: bool = False) -> str:
    r"""Return a value as one line of JSON that contains no control characters.

    Args:
        value: value for `json.dumps`.
        compact: whether to omit the blanks after commas and colons.
        letters: whether to write letters outside ASCII as they are, not as escapes.

    >>> json_text("µ\x1b\x7f\x9b\u202e", letters=True), json_text("µ\x7f")
    ('"µ\\u001b\\u007f\\u009b\\u202e"', '"\\u00b5\\u007f"')
    """
    separators = (",", ":") if compact else None
    text = json.dumps(value, ensure_ascii=not letters, separators=separators)
    return text if text.isprintable() else _UNSEEN.sub(lambda one: f"\\u{ord(one[0]):04x}", text)


def content_policy(style: str, script: str = "") -> str:
    """Return the content security policy of an HTML page, for its `meta` tag.

    It forbids the network, and allows only the style and the script of the page itself.
    """
    from base64 import b64encode  # noqa: PLC0415 - each command imports this module
    from hashlib import sha256  # noqa: PLC0415 - it takes 3 ms

    parts = [("style", style), *([("script", script)] if script else [])]
    hashes = (
        f"{kind}-src 'sha256-{b64encode(sha256(text.encode()).digest()).decode()}'"
        for kind, text in parts
    )
    return "; ".join(["default-src 'none'", *hashes, "base-uri 'none'", "form-action 'none'"])


def _shown(match: re.Match[str]) -> str:
    code = ord(match[0])
    return chr(0x2400 + code) if code < 0x20 else "␡" if code == 0x7F else f"<U+{code:04X}>"


def duration(us: int | None) -> str:
    """Return a duration as text."""
    match us:
        case None:
            return DASH
        case _ if us < 1_000:
            return f"{us} us"
        case _ if us < 1_000_000:
            return f"{us / 1_000:.3g} ms" if us < 999_500 else "1.00 s"
        case _ if us < 100_000_000:
            return f"{us / 1_000_000:.2f} s"
        case _:
            minutes, seconds = divmod(round(us / 1_000_000), 60)
            return f"{minutes} min {seconds:02} s"


def seconds(us: int) -> str:
    """Return a time in seconds as text, without trailing zeros.

    >>> seconds(630_000), seconds(2_000_000)
    ('0.63', '2')
    """
    return format_time(us).rstrip("0").rstrip(".")


def size(characters: int) -> str:
    """Return a number of characters as a size for the user.

    >>> size(999), size(3_600), size(1_100_000)
    ('999 bytes', '3.6 kB', '1.1 MB')
    """
    if characters < 1_000:
        return f"{characters} bytes"
    return f"{characters / 1e3:.3g} kB" if characters < 999_500 else f"{characters / 1e6:.3g} MB"
