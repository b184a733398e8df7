r"""Conversion between bytes and greppable text.

>>> escape(b"OK:beep\n\xff\\ ")
'OK:beep\\n\\xff\\\\\\x20'
>>> unescape(escape(bytes(range(256)))) == bytes(range(256))
True
"""

from __future__ import annotations

import re
from typing import Final

_SHORT: Final = {0x0A: r"\n", 0x0D: r"\r", 0x09: r"\t", 0x5C: r"\\"}
_TEXT: Final = tuple(
    _SHORT.get(code) or (chr(code) if 0x20 <= code < 0x7F else f"\\x{code:02x}")
    for code in range(256)
)
_CODES: Final = {text: bytes([code]) for code, text in _SHORT.items()}
_TOKEN: Final = re.compile(r"\\x[0-9a-fA-F]{2}|\\[nrt\\]|[ -\[\]-~]+")


def escape(data: bytes) -> str:
    """Return bytes as ASCII text, with an escape for each byte that is not printable ASCII.

    A blank at the beginning or end is also escaped, so that it is visible.
    """
    text = "".join(map(_TEXT.__getitem__, data))
    if text.endswith(" "):
        text = text[:-1] + r"\x20"
    return r"\x20" + text[1:] if text.startswith(" ") else text


def unescape(text: str) -> bytes:
    r"""Return the bytes from which `escape` has made a text.

    Raises:
        ValueError: the text contains a character or an escape that `escape` never writes.
    """
    out, at = [], 0
    while at < len(text):
        token = _TOKEN.match(text, at)
        if token is None:
            raise ValueError(rf"{text[at : at + 4]!r} is not ASCII, \n, \r, \t, \\ or \xHH")
        out.append(_bytes(token[0]))
        at = token.end()
    return b"".join(out)


def _bytes(token: str) -> bytes:
    if token.startswith(r"\x"):
        return bytes.fromhex(token[2:])
    return _CODES.get(token) or token.encode("ascii")
