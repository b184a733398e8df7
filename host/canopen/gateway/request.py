"""Lines that a client of a gateway sends (CiA 309-3, syntax of commands).

>>> parse_request('[7] 1 4 w 0x2000 3 vs "Don said ""go"" # 1"  # a comment')
Request(sequence=7, numbers=(1, 4), verb='w', words=('0x2000', '3', 'vs', 'Don said "go" # 1'))
>>> parse_request("# nothing") is None
True
"""

from __future__ import annotations

import re
from collections.abc import Collection
from typing import Final, NamedTuple

from tickrig.host.canopen.gateway.gateway_error import ErrorCode, GatewayError
from tickrig.host.text.names import known

_SEQUENCE: Final = re.compile(r"\s*\[([0-9]{1,10})\]")
_WORD: Final = re.compile(r'\s*(?:"((?:[^"]|"")*)"(?=\s|$)|(#).*|([^\s"]\S*))', re.DOTALL)
MAX_NUMBER: Final = 0xFFFF_FFFF
MOST_NUMBERS: Final = 2


class Request(NamedTuple):
    """A command.

    Attributes:
        sequence: number that its answer begins with.
        numbers: what stands before the verb: nothing, a node, or a net and a node.
        verb: in lower case.
        words: what stands behind the verb; strings without their quotes.
    """

    sequence: int
    numbers: tuple[int, ...]
    verb: str
    words: tuple[str, ...]


def sequence_of(line: str) -> int:
    """Return the number in front of a line, 0 if there is none that could be one."""
    found = _SEQUENCE.match(line)
    return int(found[1]) if found and int(found[1]) <= MAX_NUMBER else 0


def parse_request(line: str) -> Request | None:
    """Read a line; None for an empty one and for a comment.

    Raises:
        GatewayError: it is no command.
    """
    if not line.strip() or line.lstrip().startswith("#"):
        return None
    head = _SEQUENCE.match(line)
    if head is None or int(head[1]) > MAX_NUMBER:
        raise GatewayError(ErrorCode.SYNTAX, "a command begins with its number, as [1]")
    words, numbers = _words(line[head.end() :]), list[int]()
    while words and words[0][:1].isdecimal():
        if len(numbers) == MOST_NUMBERS:
            raise GatewayError(ErrorCode.SYNTAX, "before a command stand net and node, no more")
        numbers.append(number(words.pop(0), MAX_NUMBER, "number"))
    if not words:
        raise GatewayError(ErrorCode.SYNTAX, "there is no command")
    return Request(int(head[1]), tuple(numbers), words[0].lower(), tuple(words[1:]))


def number(word: str, most: int, what: str, least: int = 0) -> int:
    """Read a decimal or hexadecimal number; GatewayError says what it is of."""
    try:
        value = int(word, 16) if word[:2].lower() == "0x" else int(word)
    except ValueError:
        value = -1
    if not (least <= value <= most and word.isascii() and word.isalnum()):
        raise GatewayError(ErrorCode.SYNTAX, f"{what} {word!r} is not {least}..{most}")
    return value


def one_of(word: str, words: Collection[str], what: str) -> str:
    """Return a word of those that are known, in lower case."""
    if (lower := word.lower()) not in words:
        raise GatewayError(ErrorCode.SYNTAX, f"{what} {word!r}; known: {known(words)}")
    return lower


def check_count(request: Request, least: int, most: int | None) -> None:
    """Refuse a command with fewer words behind it than `least`, or more than `most`."""
    count = len(request.words)
    if count < least or (most is not None and count > most):
        raise GatewayError(
            ErrorCode.SYNTAX, f"{request.verb} with {count} words behind it; see help"
        )


def _words(text: str) -> list[str]:
    words, at = list[str](), 0
    text = text.rstrip()
    while at < len(text):
        found = _WORD.match(text, at)
        if found is None:
            raise GatewayError(ErrorCode.SYNTAX, "a quote is not closed")
        if found[2]:
            break
        words.append(found[3] if found[1] is None else found[1].replace('""', '"'))
        at = found.end()
    return words
