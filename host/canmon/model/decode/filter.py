"""Filters: which frames are wanted.

```
filter = list | or              list: candump's rules, as 123:7FF,400~700,#FF
or     = and ("or" | ",") ...
and    = not "and" ...
not    = "not" not | "(" or ")" | term
term   = 181 | 181-18F | 18FF0000-18FFFFFF | 123:7FF | 400~700 | #FF
       | nmt | sync | time | emcy | heartbeat | boot-up | guard | lss | error | unmapped | raw
       | fd | brs | esi
       | pdo | tpdo | rpdo | tpdo1 | sdo | sdo[6040h] | sdo[0x1018:1] | sdo.aborted | sdo.unanswered
       | term of 3 | term of 3-5 | node 3 | node 3-5 | node 3 operational
       | node = 3 | id < 200 | dlc = 8 | bytes > 8 | channel = can0 | kind = emcy | dir = tx
       | src = eds
       | statusword.fault | position > 1000 | 3.position > 1000 | state = stopped
```

Numbers after `id` and bare CAN-IDs are hexadecimal, all others as in Python, or as `8130h`.

>>> from tickrig.host.canmon.model.decode.decoded import Decoded
>>> from tickrig.host.canmon.model.frames import Record
>>> from tickrig.wire.can import CanFrame
>>> record = Record(0, "can0", CanFrame.parse("085#3081110700000000"))
>>> parse_filter("node=5 and (pdo or emcy)").matches(record, Decoded("emcy", 5))
True

The words of filters and rules, with where they stand.

>>> [token.text for token in tokens_of("x>=-1.5 in {-2..8130h} ±10%")]
['x', '>=', '-1.5', 'in', '{', '-2', '..', '8130h', '}', '±', '10%', '']
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.filter_terms import (
    COMPARISONS,
    EQUALITIES,
    FIELDS,
    FREE,
    HIGHEST_NODE,
    KINDS,
    KNOWN_WORDS,
    NMT_STATES,
    RANGES,
    WORDS,
    Test,
    candump_test,
    error_test,
    field_test,
    is_word,
    kind_test,
    never_holds,
    number,
    object_test,
    range_test,
    signal_place,
    signal_test,
    state_path,
    state_test,
    word_test,
)
from tickrig.host.canmon.model.frames import CandumpFilter
from tickrig.host.text.names import closest
from tickrig.wire.can import EXTENDED_MAX, STANDARD_MAX

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


_LONGEST: Final = 10_000
"""Characters of a filter or a rule."""

_DEEPEST: Final = 50
"""So many brackets and `not` may stand in each other."""

_SHOWN: Final = 200


class FilterError(ValueError):
    """Text that is no filter.

    Attributes:
        what: it should be.
        column: where, from 1.
    """

    what = "filter"

    def __init__(self, text: str, column: int, reason: str) -> None:
        shown = text if len(text) <= _SHOWN else f"{text[:_SHOWN]}..."
        super().__init__(f"{self.what} {shown!r}, column {column}: {reason}")
        self.column = column


_CAN_ID: Final = re.compile(r"[0-7][0-9A-Fa-f]{2}|[01][0-9A-Fa-f]{7}")
_RULE: Final = re.compile(r"[0-9A-Fa-f]{1,8}[:~][0-9A-Fa-f]{1,8}")
_ERRORS: Final = re.compile(r"#([0-9A-Fa-f]{1,8})")
_OBJECT: Final = re.compile(r"(?:0x)?([0-9A-Fa-f]{1,4})h?(?::(?:0x)?([0-9A-Fa-f]{1,2})h?)?")
_ADDRESS: Final = re.compile(r"([0-9]{1,3}\.)?[0-9A-Fa-f]{4}h:[0-9A-Fa-f]{2}")
_NAME: Final = re.compile(r"([0-9]{1,3}\.)?[A-Za-z_][\w.]*")
_HEX_DIGITS: Final = re.compile(r"[0-9A-Fa-f]{1,16}")
_NODES: Final = re.compile(r"([0-9]{1,3})(?:-([0-9]{1,3}))?")
_RESERVED: Final = ("and", "or", "not")
_ALIASES: Final = {"bootup": "boot-up", "ch": "channel"}


class FilterParser:
    """Recursive descent over the grammar in `filter`, one method a rule.

    Args:
        text: the filter.
    """

    wrong = FilterError

    def __init__(self, text: str) -> None:
        self._text = text
        self._signals: set[str] = set()
        self._words: set[tuple[str, str]] = set()
        self._nodes: set[range] = set()
        if len(text) > _LONGEST:
            raise self.wrong(text, _LONGEST, f"it has {len(text)} characters, at most {_LONGEST}")
        self._tokens, self._depth = tokens_of(text), 0

    def parse(self) -> Filter:
        """Read the filter; FilterError if it is none."""
        test = self._or()
        if self._next.text:
            raise self._error(f"{self._next.text!r} after the end; join terms by 'and' or 'or'")
        return Filter(self._text, test, frozenset(self._signals), self.words)

    @property
    def words(self) -> frozenset[tuple[str, str]]:
        """Words that were read and that no decoder of ours says, as `Filter.words`."""
        return frozenset(self._words)

    @property
    def _next(self) -> Token:
        return self._tokens[0]

    def _take(self, *words: str) -> bool:
        """Take the next token if it is one of these."""
        if self._next.text not in words:
            return False
        del self._tokens[0]
        return True

    def _error(self, reason: str) -> FilterError:
        return self.wrong(self._text, self._next.column, reason)

    def _or(self) -> Test:
        tests = [self._and()]
        while self._take("or", ","):
            tests.append(self._and())
        if len(tests) == 1:
            return tests[0]
        return lambda record, decoded: any(test(record, decoded) for test in tests)

    def _and(self) -> Test:
        tests = [self._not()]
        while self._take("and"):
            tests.append(self._not())
        if len(tests) == 1:
            return tests[0]
        return lambda record, decoded: all(test(record, decoded) for test in tests)

    def _not(self) -> Test:
        if self._next.text not in ("not", "!", "("):
            return self._term()
        if self._depth == _DEEPEST:
            raise self._error(f"nested deeper than {_DEEPEST}")
        self._depth += 1
        if self._take("not", "!"):
            inner = self._not()
            test: Test = lambda record, decoded: not inner(record, decoded)  # noqa: E731
        else:
            self._take("(")
            test = self._or()
            self._expect(")")
        self._depth -= 1
        return test

    def _expect(self, word: str) -> None:
        if not self._take(word):
            raise self._error(f"{word!r} is missing")

    def _term(self) -> Test:
        before = set(self._signals)
        test = self._plain_term()
        if not self._take("of"):
            return test
        nodes = self._node_ids()
        new = self._signals - before
        self._signals = before | {f"{node}.{path}" for path in new for node in nodes}
        return lambda record, decoded: decoded.node in nodes and test(record, decoded)

    def _node_ids(self) -> range:
        """Take node-IDs, as 3 or 3-5."""
        match = _NODES.fullmatch(self._next.text)
        nodes = range(int(match[1]), int(match[2] or match[1]) + 1) if match else range(0)
        if not nodes or nodes[0] < 1 or nodes[-1] > HIGHEST_NODE:
            came = repr(self._next.text) if self._next.text else "nothing"
            order = "; the lower one stands first" if match and not nodes else ""
            raise self._error(f"{came} is no node-ID 1 to {HIGHEST_NODE}, as 3 or 3-5{order}")
        del self._tokens[0]
        self._nodes.add(nodes)
        return nodes

    def _node(self) -> Test:
        """Take what stands behind `node`: node-IDs, and an NMT state where there is one."""
        nodes, word = self._node_ids(), self._next.text
        if word not in NMT_STATES:
            return lambda record, decoded: decoded.node in nodes
        del self._tokens[0]
        self._signals |= {state_path(node) for node in nodes}
        return state_test(nodes, NMT_STATES[word])

    def _plain_term(self) -> Test:
        word = self._next.text
        word = _ALIASES.get(word, word)
        if not word or word in _RESERVED or not re.match(r"[\w#]", word):
            raise self._error("a term is missing, as emcy, node=3, 181-18F or statusword.fault")
        if word in FIELDS or word in WORDS:
            del self._tokens[0]
            if word == "node" and self._next.text[:1].isdecimal():
                return self._node()
            return self._field(word)
        test = self._id_test(word) or kind_test(word)
        if test is None:
            return self._signal(word)
        del self._tokens[0]
        if word == "sdo" and self._take("["):
            test = self._object()
            self._expect("]")
        return test

    def _id_test(self, word: str) -> Test | None:
        """Return the test of CAN-IDs; None for other words."""
        if _RULE.fullmatch(word):
            return candump_test(CandumpFilter.parse(word))
        if errors := _ERRORS.fullmatch(word):
            return error_test(int(errors[1], 16))
        low, dash, high = word.partition("-")
        if not _CAN_ID.fullmatch(low) or (dash and not _CAN_ID.fullmatch(high)):
            return None
        high = high or low
        extended = len(low) == 8
        numbers = int(low, 16), int(high, 16)
        most = EXTENDED_MAX if extended else STANDARD_MAX
        if len(low) != len(high) or not numbers[0] <= numbers[1] <= most:
            raise self._error(f"{word} is no range of CAN-IDs like 181-18F")
        return range_test(*numbers, extended=extended)

    def _object(self) -> Test:
        match = _OBJECT.fullmatch(self._next.text)
        if match is None:
            raise self._error(f"{self._next.text!r} is no object like 6040h or 0x1018:1")
        del self._tokens[0]
        return object_test(int(match[1], 16), int(match[2], 16) if match[2] else None)

    def _field(self, name: str) -> Test:
        sign, value = self._comparison(name)
        if name in WORDS:
            if sign not in EQUALITIES:
                raise self._error(f"{name} can be compared by = and != alone")
            value = _ALIASES.get(value, value)
            if not is_word(name, value):
                words = KNOWN_WORDS[name]
                meant = [f"; did you mean {word!r}?" for word in closest(value, words)]
                if meant or name not in FREE:
                    said = f"{name} is never {value!r}, but {', '.join(words)}"
                    raise self._error(said + "".join(meant))
                self._words.add((name, value))
            del self._tokens[0]
            return word_test(name, sign, value)
        wanted = _hexadecimal(value) if name == "id" else number(value)
        if wanted is None:
            raise self._error(f"{value!r} is no number")
        if never_holds(name, sign, wanted):
            low, high = RANGES[name][0], RANGES[name][-1]
            ends = f"{low:X} to {high:X}" if name == "id" else f"{low} to {high}"
            raise self._error(f"{name} is {ends}, never {sign.strip('=!')}{value}")
        del self._tokens[0]
        return field_test(name, COMPARISONS[sign], wanted)

    def _comparison(self, name: str) -> tuple[str, str]:
        """Take the sign; return it and the value behind it, which is not taken yet."""
        sign = self._next.text
        if sign not in COMPARISONS:
            raise self._error(f"{name} is compared by one of {' '.join(COMPARISONS)}")
        del self._tokens[0]
        if not self._next.text or not re.match(r"[\w.+-]", self._next.text):
            raise self._error("a value is missing")
        return sign, self._next.text

    def _signal(self, word: str) -> Test:
        if not _ADDRESS.fullmatch(word) and not _NAME.fullmatch(word):
            raise self._error(f"{word!r} is neither a kind ({', '.join(KINDS)}) nor a signal")
        node, _, _ = signal_place(word)
        if node is not None and node not in RANGES["node"]:
            raise self._error(f"{node} is no node-ID 1 to {HIGHEST_NODE}")
        del self._tokens[0]
        self._signals.add(word)
        if self._next.text not in COMPARISONS:
            return signal_test(word)
        sign, value = self._comparison(word)
        if number(value) is None and sign not in EQUALITIES:
            raise self._error(f"{value!r} is no number")
        del self._tokens[0]
        return signal_test(word, sign, value)


def _hexadecimal(text: str) -> int | None:
    digits = text.removeprefix("0x").removesuffix("h")
    return int(digits, 16) if _HEX_DIGITS.fullmatch(digits) else None


@dataclass(frozen=True, slots=True)
class Filter:
    """A filter that was read.

    Attributes:
        text: as it was written.
        matches: says whether a frame is wanted.
        signals: names of the signals it asks for, to tell when none of them ever comes.
        words: field and word for each word that only a decoder of an installed package can say.
    """

    text: str
    matches: Test
    signals: frozenset[str] = frozenset()
    words: frozenset[tuple[str, str]] = frozenset()


def parse_filter(text: str) -> Filter:
    """Read a filter.

    Raises:
        FilterError: it is none; says the column.
    """
    try:
        chosen = CandumpFilter.parse(text)
    except ValueError:
        return FilterParser(text).parse()
    return Filter(text, candump_test(chosen))
