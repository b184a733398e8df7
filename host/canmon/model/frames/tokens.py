"""The words of filters and rules, with where they stand.

>>> [token.text for token in tokens_of("x>=-1.5 in {-2..8130h} ±10%")]
['x', '>=', '-1.5', 'in', '{', '-2', '..', '8130h', '}', '±', '10%', '']
"""

from __future__ import annotations

import re
from typing import Final, NamedTuple

_TOKEN: Final = re.compile(
    r"\s*([()\[\]{},±]|\+-|\.\.|==|!=|<=|>=|[=<>]|(?:(?!\.\.|\+-)[^\s()\[\]{},±=!<>])+|.)"
)


class Token(NamedTuple):
    """A word or a sign, and its column from 1."""

    text: str
    column: int


def tokens_of(text: str) -> list[Token]:
    """Take a text apart; the last token is empty."""
    tokens = []
    at, end = 0, len(text.rstrip())
    while at < end:
        match = _TOKEN.match(text, at)
        assert match is not None  # a token is any character
        tokens.append(Token(match[1], match.start(1) + 1))
        at = match.end()
    return [*tokens, Token("", end + 1)]
