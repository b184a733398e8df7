"""What stands behind a demand: times, spans, counts and sets of values."""

from __future__ import annotations

import re
from typing import Final

from tickrig.host.canmon.model.check.expression.parse_values import time_us, tolerance_us, values_of
from tickrig.host.canmon.model.check.expression.slice_parser import SliceParser
from tickrig.host.canmon.model.check.expression.value_demands import Values
from tickrig.host.canmon.model.decode.filter import FilterError
from tickrig.host.canmon.model.decode.filter_terms import number


class RuleError(FilterError):
    """Text that is no rule."""

    what = "rule"


SCOPES: Final = ("after", "before", "while")
UNITS: Final = ("s", "ms", "us", "%")
"""Of what has no blank before its unit."""

_COUNT: Final = re.compile(r"[0-9]{1,9}")


class QuantityParser(SliceParser):
    """Takes quantities from the words of a rule.

    Args:
        text: the rule.
    """

    wrong = RuleError
    _word_column = 1

    def _whole(self) -> int:
        if not _COUNT.fullmatch(self._next.text):
            raise self._error(f"{self._came()} is no count, as 3")
        return int(self._tokens.pop(0).text)

    def _number(self) -> float:
        found = number(self._next.text)
        if found is None or found != found:  # noqa: PLR0124 - what is no number
            raise self._error(f"{self._came()} is no number")
        del self._tokens[0]
        return found

    def _under(self) -> int:
        """Take a limit of time."""
        if not self._take("under", "within"):
            raise self._error(f"{self._came()} where 'under' or 'within' and a time are wanted")
        return self._time()

    def _time(self) -> int:
        found = time_us(self._next.text)
        if found is None:
            raise self._error(f"{self._came()} is no time, as 2s, 50ms or 250us{self._blank()}")
        del self._tokens[0]
        return found

    def _blank(self) -> str:
        """Say so where a blank stands between a number and its unit."""
        value, unit = self._tokens[0].text, self._tokens[1:2]
        if number(value) is None or not unit or unit[0].text not in UNITS:
            return ""
        return f"; without a blank, as {value}{unit[0].text}"

    def _span(self) -> tuple[int, int | None]:
        """Take how far frames may be apart: `10ms ±10%`, `9ms..11ms`, `5ms..`, `..20ms`."""
        if self._take(".."):
            return 0, self._time()
        low_us = self._time()
        if self._take(".."):
            is_open = time_us(self._next.text) is None and not self._next.text[:1].isdecimal()
            return self._ordered(low_us, None if is_open else self._time())
        if not self._take("±", "+-"):
            wanted = "wanted how far off is right, as ±10%, ±500us or 9ms..11ms"
            raise self._error(f"{self._came()} behind the time; {wanted}")
        off_us = tolerance_us(self._next.text, low_us)
        if off_us is None:
            wanted = "neither a share, as 10%, nor a time, as 500us"
            raise self._error(f"{self._came()} is {wanted}{self._blank()}")
        del self._tokens[0]
        return max(0, low_us - off_us), low_us + off_us

    def _ordered(self, low_us: int, high_us: int | None) -> tuple[int, int | None]:
        if high_us is not None and high_us < low_us:
            raise self._error("the time before '..' is above the one behind it")
        return low_us, high_us

    def _values(self) -> Values:
        """Take what is right: `{1, 8130h, 5..9, stopped}`, or `1..5` alone."""
        begin = self._next.column - 1
        parts = [self._value()] if not self._take("{") else self._members()
        text = self._text[begin : self._next.column - 1].strip()
        try:
            return Values(text, values_of(parts))
        except ValueError as error:
            raise self._error(str(error)) from None

    def _members(self) -> list[tuple[str, ...]]:
        parts = [self._value()]
        while self._take(","):
            parts.append(self._value())
        self._expect("}")
        return parts

    def _value(self) -> tuple[str, ...]:
        """Take a value, or both ends of a range; an end that is open is empty."""
        low = "" if self._next.text == ".." else self._word()
        if not self._take(".."):
            return (low,)
        is_open = not self._next.text or self._next.text in (*SCOPES, ",", "}")
        return low, "" if is_open else self._word()

    def _word(self) -> str:
        if not re.match(r"[\w.+-]", self._next.text):
            raise self._error(f"{self._came()} where a value is wanted, as 8130h, 5..9 or {{1, 2}}")
        return self._tokens.pop(0).text

    def _take_one(self, *words: str) -> str:
        """Take the next token if it is one of these; return it, or nothing."""
        word, column = self._next
        if not self._take(*words):
            return ""
        self._word_column = column
        return word

    def _refuse_word(self, reason: str) -> RuleError:
        """Return the error of the word that `_take_one` took."""
        return RuleError(self._text, self._word_column, reason)

    def _came(self) -> str:
        return repr(self._next.text) if self._next.text else "the end"
