"""EMCYs that take an error back: where errors are looked for they are none."""

from __future__ import annotations

from collections.abc import Collection, Iterable
from typing import Final

from tickrig.host.canmon.model.decode.decoded import Decoded
from tickrig.host.canmon.model.decode.filter_terms import Test
from tickrig.host.canmon.model.frames.tokens import Token

EMCY: Final = "emcy"
OTHERS: Final = frozenset(["not", "!", "!="])


def errors_alone(test: Test, tokens: Iterable[Token], signals: Collection[str]) -> Test:
    """Return the test of frames as events: an EMCY of code 0000h is none.

    It stays one where the filter does not name `emcy`, has a `not`, or names a signal, as
    `emcy and code = 0`.

    Args:
        test: of the filter.
        tokens: its words.
        signals: that it asks for.
    """
    words = {token.text for token in tokens}
    if signals or EMCY not in words or words & OTHERS:
        return test
    return lambda record, decoded: test(record, decoded) and not _is_reset(decoded)


def _is_reset(decoded: Decoded) -> bool:
    return decoded.kind == EMCY and bool(decoded.signals) and not decoded.signals[0].value
