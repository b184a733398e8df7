"""Frames in text, and patterns that they match.

The module also describes the difference between a frame and the expected patterns in words. SDO
answers are described by their meaning.

>>> unlike("585#6000160100000000", ["585#8000160141000406", "585#8000160142000406"])
'got OK (60h), want abort 0604 0041h or 0604 0042h'
>>> unlike("585#8000200111000906", ["585#4[2F]002001........"])
'got abort 0609 0011h (sub-index does not exist), want 585#4[2F]002001........'
>>> unlike("585#4F00200000000000", ["585#4[2F]002000A5......"])
'got 00, want A5'
>>> unlike("585#8000100011000906", ["585#8000100111000906"])
'got abort 0609 0011h (sub-index does not exist) of 1000h:00, want abort 0609 0011h of 1000h:01'
>>> unlike("585#2000000000000000", ["585#8007200013000706"])
'got 585#2000000000000000, want abort 0607 0013h'
>>> unlike("705#7F", ["705#00"])
'got 705#7F, want 705#00'
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence
from functools import cache
from typing import Final

from tickrig.wire.canopen.sdo_frame import describe_abort


def can_id_of(pattern: str) -> str:
    """Return the CAN-ID of a frame or a pattern in text."""
    return pattern.partition("#")[0]


def matches(pattern: str, text: str) -> bool:
    """Return whether a frame matches a pattern, both in candump notation.

    In a pattern, a dot stands for any digit, `[..]` stands for one of the digits in the brackets,
    and `*` stands for any rest of the frame.

    >>> matches("585#4F011000........", "585#4F01100003000000"), matches("185#*", "185#0100")
    (True, True)
    """
    return _compiled(pattern).fullmatch(text) is not None


@cache
def _compiled(pattern: str) -> re.Pattern[str]:
    return re.compile(pattern.replace("*", ".*"))


_ABORT: Final = re.compile(r"5[89A-F][0-9A-F]#80([0-9A-F.]{6})([0-9A-F]{8})")
_OK: Final = re.compile(r"5[89A-F][0-9A-F]#60([0-9A-F]{6})0{8}")
_VALUE: Final = re.compile(r"5[89A-F][0-9A-F]#4[0-9A-F]([0-9A-F]{6})[0-9A-F]{8}")
_WANTED_VALUE: Final = re.compile(r"(5.*?#4(?:[0-9A-F]|\[\w+\])[0-9A-F]{6})([0-9A-F]+)\.*")
_ANY_OBJECT: Final = "......"
_DIGITS: Final = 8
"""Number of data digits after index and sub-index."""


def unlike(got: str, wanted: Sequence[str]) -> str:
    """Return a text that explains how a received frame differs from the expected ones.

    Args:
        got: received frame in candump notation.
        wanted: patterns of the expected frames, none of which matches.
    """
    if len(wanted) == 1 and (values := _values(got, wanted[0])):
        return f"got {values[0]}, want {values[1]}"
    aborts = [match for pattern in wanted if (match := _ABORT.fullmatch(pattern))]
    if not aborts and not _ABORT.fullmatch(got):
        return f"got {got}, want {wanted_text(wanted)}"
    objects = {match[1] for match in aborts}
    came = _object(got)
    alike = came == _ANY_OBJECT or all(matches(each, came) for each in objects)
    of = "" if alike or len(objects) > 1 else f" of {_place(objects.pop())}"
    where = "" if alike else f" of {_place(came)}"
    return f"got {_words(got)}{where}, want {wanted_text(wanted)}{of}"


def abort_of(got: str) -> int | None:
    """Return the abort code in a frame in candump notation, or None if it is no SDO abort.

    >>> f"{abort_of('585#8000100002000106'):08X}", abort_of("705#00")
    ('06010002', None)
    """
    match = _ABORT.fullmatch(got)
    return int(_code(match[2]), 16) if match and match[2].isalnum() else None


def wanted_text(wanted: Sequence[str]) -> str:
    """Return the expected frames in words. SDO aborts are given by their codes.

    >>> wanted_text(["585#8000100002000106"]), wanted_text(["705#00", "705#7F"])
    ('abort 0601 0002h', '705#00 or 705#7F')
    """
    others = [pattern for pattern in wanted if not _ABORT.fullmatch(pattern)]
    aborts = [match for pattern in wanted if (match := _ABORT.fullmatch(pattern))]
    codes = dict.fromkeys(_code(match[2]) for match in aborts)
    return " or ".join([*others, *([f"abort {codes_text(codes)}"] if codes else [])])


def codes_text(codes: Iterable[str]) -> str:
    """Write abort codes in the notation of CiA 301.

    >>> codes_text(["06010002", "06010000", "08000000"])
    '0601 0002h, 0601 0000h or 0800 0000h'
    """
    texts = [f"{code[:4]} {code[4:]}h" for code in codes]
    return " or ".join(filter(None, [", ".join(texts[:-1]), texts[-1]]))


def _values(got: str, wanted: str) -> tuple[str, str] | None:
    """Return the data of two upload answers that differ only in these data."""
    match = _WANTED_VALUE.fullmatch(wanted)
    if match is None or _VALUE.fullmatch(got) is None:
        return None
    head, data = got[:-_DIGITS], got[-_DIGITS:]
    return (data[: len(match[2])], match[2]) if matches(match[1], head) else None


def _words(got: str) -> str:
    if match := _ABORT.fullmatch(got):
        code = _code(match[2])
        return f"abort {codes_text([code])} ({describe_abort(int(code, 16)).rpartition(' (')[0]})"
    if _OK.fullmatch(got):
        return "OK (60h)"
    if _VALUE.fullmatch(got):
        return "a value"
    return got


def _object(got: str) -> str:
    """Return the index and sub-index that an answer names, or dots if it names no object."""
    match = _ABORT.fullmatch(got) or _OK.fullmatch(got) or _VALUE.fullmatch(got)
    return match[1] if match else _ANY_OBJECT


def _place(name: str) -> str:
    """Write a multiplexer as an index and a sub-index."""
    return f"{name[2:4]}{name[:2]}h:{name[4:]}"


def _code(data: str) -> str:
    """Return an abort code with the highest byte first. A frame has the lowest byte first."""
    return bytes.fromhex(data)[::-1].hex().upper()
