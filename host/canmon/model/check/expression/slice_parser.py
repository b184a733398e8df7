"""Bits of frames in rules, as `canmon graph` names them: `181[2:6]s*0.001`, `181[0.3]`.

A slice is a signal of its frames, whatever else they mean.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final

from tickrig.host.canmon.model.decode.decoded import Decoded, Signal
from tickrig.host.canmon.model.decode.filter import FilterParser
from tickrig.host.canmon.model.decode.filter_terms import COMPARISONS, Test, number, signal_test
from tickrig.host.canmon.model.frames.record import Record
from tickrig.host.canmon.model.graph.signal_spec import EXTENDED, FrameSlice, parse_slice
from tickrig.wire.can_error import ErrorFrame

_CAN_ID: Final = re.compile(r"[0-9A-Fa-f]{3}|[0-9A-Fa-f]{8}")
_TYPE: Final = re.compile(r"[usfb*/+-]\S*")

Slice = tuple[str, FrameSlice]
"""Bits of a frame, under the name by which a rule asks for them."""


class SliceParser(FilterParser):
    """Takes slices where a filter takes signals.

    Args:
        text: the rule.
    """

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self._slices: dict[str, FrameSlice] = {}

    def _plain_term(self) -> Test:
        if not self._is_slice():
            return super()._plain_term()
        name = self._slice()
        self._signals.add(name)
        if self._next.text not in COMPARISONS:
            return signal_test(name)
        sign, value = self._comparison(name)
        if number(value) is None:
            raise self._error(f"{value!r} is no number")
        del self._tokens[0]
        return signal_test(name, sign, value)

    def _is_slice(self) -> bool:
        word, column = self._next
        is_id = _CAN_ID.fullmatch(word) is not None
        return is_id and self._tokens[1] == ("[", column + len(word))

    def _slice(self) -> str:
        """Take the words of a slice; return it as it is written."""
        begin = self._next.column - 1
        while self._next.text not in ("]", ""):
            del self._tokens[0]
        end = self._next.column
        self._expect("]")
        if self._next.column == end + 1 and _TYPE.fullmatch(self._next.text):
            end += len(self._tokens.pop(0).text)
        name = self._text[begin:end]
        try:
            self._slices[name] = parse_slice(name)
        except ValueError as reason:
            raise self.wrong(self._text, begin + 1, str(reason)) from None
        return name


def with_slices(record: Record, decoded: Decoded, slices: Iterable[Slice]) -> Decoded:
    """Return what a frame says, with the slices that are of it."""
    frame = record.frame
    if isinstance(frame, ErrorFrame) or frame.remote:
        return decoded
    key = frame.can_id | EXTENDED if frame.extended else frame.can_id
    values = [(name, cut.value(frame.data)) for name, cut in slices if cut.key == key]
    found = [Signal(name, _plain(value)) for name, value in values if value is not None]
    if not found:
        return decoded
    text = " ".join([decoded.text, *map(str, found)]).strip()
    return decoded._replace(signals=(*decoded.signals, *found), summary=text)


def _plain(value: float) -> float:
    return int(value) if float(value).is_integer() else value
