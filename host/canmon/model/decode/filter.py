"""Filters that select the wanted frames.

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

The tokens are the words of filters and rules, with their columns.

>>> [token.text for token in tokens_of("x>=-1.5 in {-2..8130h} ±10%")]
['x', '>=', '-1.5', 'in', '{', '-2', '..', '8130h', '}', '±', '10%', '']
"""

from __future__ import annotations

import operator
import re
from collections.abc import Callable, Collection, Iterable
from dataclasses import dataclass
from typing import Final, NamedTuple

from tickrig.host.canmon.model.decode.decoded import (
    DBC,
    EDS,
    SEEN,
    Decoded,
    Signal,
    TransferOutcome,
)
from tickrig.host.canmon.model.decode.node_memory import BITS
from tickrig.host.canmon.model.frames import AnyRecord, CandumpFilter, Record, flagged_id
from tickrig.host.text.names import closest
from tickrig.wire.can import EXTENDED_MAX, MAX_FD_BYTES, STANDARD_MAX, CanFrame, ErrorFrame, FdFrame
from tickrig.wire.canopen.nmt import NmtState

# The signals that a filter asks for and that have not come: a name may be misspelt.


Test = Callable[[AnyRecord, Decoded], bool]
_Compare = Callable[[float, float], bool]

COMPARISONS: Final[dict[str, _Compare]] = {
    "=": operator.eq,
    "==": operator.eq,
    "!=": operator.ne,
    "<": operator.lt,
    "<=": operator.le,
    ">": operator.gt,
    ">=": operator.ge,
}
_EQUALITIES: Final = ("=", "==", "!=")
KINDS: Final = (
    *("nmt", "sync", "time", "emcy", "heartbeat", "boot-up", "guard", "sdo", "lss", "dbc"),
    *("unmapped", "raw", "error", "rrc", "rtc-lite"),
)
_FD_KINDS: Final[dict[str, Callable[[FdFrame], bool]]] = {
    "fd": lambda frame: True,
    "brs": lambda frame: frame.brs,
    "esi": lambda frame: frame.esi,
}
_OUTCOMES: Final = {
    "sdo.aborted": TransferOutcome.ABORTED,
    "sdo.unanswered": TransferOutcome.UNANSWERED,
    "sdo.broken": TransferOutcome.BROKEN,
}
_FIELDS: Final[dict[str, Callable[[AnyRecord, Decoded], int | None]]] = {
    "node": lambda record, decoded: decoded.node,
    "id": lambda record, decoded: _can_id(record),
    "dlc": lambda record, decoded: getattr(record.frame, "dlc", None),
    "bytes": lambda record, decoded: None if record.frame is None else len(record.frame.data),
}
_WORDS: Final[dict[str, Callable[[AnyRecord, Decoded], str]]] = {
    "channel": lambda record, decoded: record.channel,
    "kind": lambda record, decoded: decoded.kind,
    "dir": lambda record, decoded: "tx" if record.sent else "rx",
    "src": lambda record, decoded: decoded.source,
}

_HIGHEST_NODE: Final = 127
_RANGES: Final = {
    "node": range(1, _HIGHEST_NODE + 1),
    "id": range(EXTENDED_MAX + 1),
    "dlc": range(16),
    "bytes": range(MAX_FD_BYTES + 1),
}
"""Possible values of the numbers in `_FIELDS`."""
KNOWN_WORDS: Final = {"kind": (*KINDS, "fd"), "dir": ("rx", "tx"), "src": (EDS, SEEN, DBC)}
"""Possible words of `_WORDS`, in addition to PDOs by their numbers."""
_FREE: Final = ("kind", "src")
"""Fields in which decoders of installed packages may use other words."""
_ERROR_CONTROL: Final = ("boot-up", "heartbeat", "guard")
NMT_STATES: Final = {state.name.lower().replace("_", "-"): int(state) for state in NmtState}

_STATE: Final = re.compile(r"state of node ([0-9]+)")
_BIT: Final = re.compile(r"[0-9]{1,2}")
_HEX: Final = re.compile(r"(-?)([0-9][0-9A-Fa-f]*)h")
_PDO: Final = re.compile(r"([tr]?)pdo([0-9]{0,3})")
_NODE: Final = re.compile(r"([0-9]{1,3})\.(.+)")


def _kind_test(word: str) -> Test | None:
    """Return the test for a kind of frame, or for the outcome of an SDO transfer."""
    if word in _FD_KINDS:
        test = _FD_KINDS[word]
        return lambda record, decoded: isinstance(record.frame, FdFrame) and test(record.frame)
    if word in KINDS:
        return lambda record, decoded: decoded.kind == word
    if word in _OUTCOMES:
        outcome = _OUTCOMES[word]
        return lambda record, decoded: any(t.outcome is outcome for t in decoded.transfers)
    match = _PDO.fullmatch(word)
    if match is None:
        return None
    directions = (match[1],) if match[1] else ("t", "r")
    unmapped = ("unmapped",) if word == "pdo" else ()
    if match[2]:
        kinds = tuple(f"{direction}pdo{match[2]}" for direction in directions)
        return lambda record, decoded: decoded.kind in kinds
    begins = (*(f"{direction}pdo" for direction in directions), *unmapped)
    return lambda record, decoded: decoded.kind.startswith(begins)


def _state_path(node: int) -> str:
    """Return the name that a filter uses for the NMT state of a node."""
    return f"state of node {node}"


def _state_test(nodes: range, state: int) -> Test:
    """Return the test for nodes with a known NMT state."""
    return lambda record, decoded: (
        decoded.node in nodes
        and decoded.kind in _ERROR_CONTROL
        and any(signal.value == state for signal in decoded.signals)
    )


def _object_test(index: int, sub: int | None) -> Test:
    """Return the test for SDO frames about an object."""

    def test(record: AnyRecord, decoded: Decoded) -> bool:
        entries = (decoded.entry, *(transfer.entry for transfer in decoded.transfers))
        return any(entry and entry[0] == index and sub in (None, entry[1]) for entry in entries)

    return test


def _range_test(low: int, high: int, *, extended: bool) -> Test:
    """Return the test for CAN-IDs in a range that includes both ends."""

    def test(record: AnyRecord, decoded: Decoded) -> bool:
        frame = record.frame
        if not isinstance(frame, CanFrame | FdFrame) or frame.extended != extended:
            return False
        return low <= frame.can_id <= high

    return test


def _error_test(mask: int) -> Test:
    """Return the test for error frames of some classes."""
    return lambda record, decoded: (
        isinstance(record.frame, ErrorFrame) and bool(record.frame.error_class & mask)
    )


def _candump_test(chosen: CandumpFilter) -> Test:
    """Return the test of candump's rules."""
    return lambda record, decoded: isinstance(record, Record) and chosen.passes(flagged_id(record))


def _never_holds(name: str, sign: str, value: float) -> bool:
    """Return whether a field can never match a comparison, so that the comparison is a mistake."""
    numbers, compare = _RANGES[name], COMPARISONS[sign]
    if sign in _EQUALITIES:
        return value not in numbers
    return not (compare(numbers[0], value) or compare(numbers[-1], value))


def _is_word(name: str, value: str) -> bool:
    """Return whether a field may have a word."""
    is_pdo = name == "kind" and _PDO.fullmatch(value) is not None and value[-1:].isdecimal()
    return name not in KNOWN_WORDS or value in KNOWN_WORDS[name] or is_pdo


def _field_test(name: str, compare: _Compare, value: float) -> Test:
    """Return the test for a number that every frame of a kind has."""
    field = _FIELDS[name]

    def test(record: AnyRecord, decoded: Decoded) -> bool:
        found = field(record, decoded)
        return found is not None and compare(found, value)

    return test


def _word_test(name: str, sign: str, value: str) -> Test:
    """Return the test for a word."""
    word, wanted = _WORDS[name], sign != "!="
    return lambda record, decoded: (word(record, decoded) == value) == wanted


def signal_test(path: str, sign: str = "!=", text: str = "0") -> Test:
    """Return a function that tests whether a signal in a frame fulfils a comparison.

    The default comparison is `!= 0`. A frame without the signal does not fulfil any comparison.

    Args:
        path: name of the signal, such as `position`, `3.position` for a node, or `statusword.fault`
            or `statusword.3` for a bit.
        sign: comparison operator, one of `COMPARISONS`.
        text: value with which the signal is compared.
    """
    find, compare = signal_reader(path), comparison(sign, text)

    def test(record: AnyRecord, decoded: Decoded) -> bool:
        signal = find(decoded)
        return signal is not None and compare(signal)

    return test


def signal_reader(path: str) -> Callable[[Decoded], Signal | None]:
    """Return a function that reads a signal, or one bit of a signal, from a decoded frame.

    The function returns None if the frame does not contain the signal.

    Args:
        path: name of the signal or bit, as for `signal_test`.
    """
    if match := _STATE.fullmatch(path):
        return _state_reader(int(match[1]))
    node, whole, shift = signal_place(path)
    base, _, digits = whole.rpartition(".")
    number = int(digits) if base and _BIT.fullmatch(digits) else None

    def find(decoded: Decoded) -> Signal | None:
        if node is not None and decoded.node != node:
            return None
        for signal in decoded.signals:
            if signal.name == whole:
                return signal if shift is None else _bit(signal, shift)
            if number is not None and signal.name == base:
                return _bit(signal, number)
        return None

    return find


def _state_reader(node: int) -> Callable[[Decoded], Signal | None]:
    return lambda decoded: (
        decoded.signals[0]
        if decoded.node == node and decoded.kind in _ERROR_CONTROL and decoded.signals
        else None
    )


def signal_place(path: str) -> tuple[int | None, str, int | None]:
    """Split a path that names a signal in a filter, such as `3.statusword.fault`.

    The result contains three parts: the node-ID, the name of the signal, and the number of a bit.
    The node-ID is None if the path contains no node. The number of the bit is None if the path
    contains no name of a bit.

    >>> signal_place("3.statusword.fault"), signal_place("position")
    ((3, 'statusword', 3), (None, 'position', None))
    """
    match = _NODE.fullmatch(path)
    node, name = (int(match[1]), match[2]) if match else (None, path)
    base, _, bit = name.rpartition(".")
    shift = BITS.get(base, {}).get(bit)
    return node, name if shift is None else base, shift


def number(text: str) -> float | None:
    """Parse a number as written in filters, or return None if the text is not a number.

    An integer may be decimal, or hexadecimal as in `0x10` or `8130h`.

    >>> number("0x10"), number("-1.5"), number("8130h"), number("fast")
    (16, -1.5, 33072, None)
    """
    match = _HEX.fullmatch(text)
    if match:
        return int(match[1] + match[2], 16)
    if not text.isascii() or "_" in text:
        return None
    for read in (lambda digits: int(digits, 0), float):
        try:
            return read(text)
        except ValueError:
            continue
    return None


def comparison(sign: str, text: str) -> Callable[[Signal], bool]:
    """Return a function that tests whether a signal fulfils a comparison with a given value.

    A given number is compared with the value of the signal. Any other given value is compared with
    the text of the signal.

    Args:
        sign: comparison operator from `COMPARISONS`. If the value is not a number, only the
            operators from `_EQUALITIES` are allowed.
        text: value with which signals are compared.
    """
    wanted, compare = number(text), COMPARISONS[sign]
    if wanted is None:
        words, equal = text.lower(), sign != "!="
        return lambda signal: (words in (signal.text.lower(), str(signal.value).lower())) == equal

    def holds(signal: Signal) -> bool:
        value = signal.value
        return isinstance(value, int | float) and compare(value, wanted)

    return holds


def _bit(signal: Signal, shift: int) -> Signal:
    """Return one bit of a signal. If the signal is not a number, the result equals no value."""
    value = signal.value
    return Signal(signal.name, value >> shift & 1 if isinstance(value, int) else "")


def _can_id(record: AnyRecord) -> int | None:
    return record.frame.can_id if isinstance(record.frame, CanFrame | FdFrame) else None


class MissingSignals:
    """List of signals and words that filters contain, and that the traffic has not contained yet.

    A signal or word that never occurs may be misspelt. So the command reports it to the user.

    Args:
        paths: names of signals in filters, such as `position`, `3.position` or `statusword.fault`.
        words: unknown words that filters compare with a field, as in `kind=word`. Each is a pair of
            the field (`kind`) and the word. A word is unknown if no built-in decoder uses it as a
            value of the field.
    """

    def __init__(self, paths: Iterable[str], words: Iterable[tuple[str, str]] = ()) -> None:
        self._left = {path: signal_reader(path) for path in sorted(paths)}
        self._words = sorted(words)

    def __bool__(self) -> bool:
        """Return whether any signal or word is missing."""
        return bool(self._left or self._words)

    def take(self, record: AnyRecord, decoded: Decoded) -> None:
        """Remove signals and words that a decoded frame contains."""
        if decoded.signals:
            left = self._left.items()
            self._left = {path: find for path, find in left if find(decoded) is None}
        if self._words:
            self._words = [
                word for word in self._words if _WORDS[word[0]](record, decoded) != word[1]
            ]

    @property
    def paths(self) -> list[str]:
        """The signals that have not occurred."""
        return list(self._left)

    @property
    def words(self) -> list[str]:
        """The words that have not occurred, as `kind=word`."""
        return [f"{name}={word}" for name, word in self._words]

    def messages(self) -> list[str]:
        """Report the signals and words that never occurred, one per line."""
        known = (*_FIELDS, *_WORDS, *KINDS)
        signals = [
            f"the filter asks for {path!r}: no such signal came"
            + "".join(f"; did you mean {word!r}?" for word in closest(path, known))
            for path in self._left
        ]
        return signals + [
            f"the filter asks for {name}={word}: no such frame came;"
            f" there are {', '.join(KNOWN_WORDS[name])}"
            for name, word in self._words
        ]


_TOKEN: Final = re.compile(
    r"\s*([()\[\]{},±]|\+-|\.\.|==|!=|<=|>=|[=<>]|(?:(?!\.\.|\+-)[^\s()\[\]{},±=!<>])+|.)"
)


class Token(NamedTuple):
    """A word or a sign with its column, which counts from 1."""

    text: str
    column: int


def tokens_of(text: str) -> list[Token]:
    """Split a text into tokens. The last token is empty."""
    tokens = []
    at, end = 0, len(text.rstrip())
    while at < end:
        match = _TOKEN.match(text, at)
        assert match is not None  # a token is any character
        tokens.append(Token(match[1], match.start(1) + 1))
        at = match.end()
    return [*tokens, Token("", end + 1)]


_LONGEST: Final = 10_000
"""Maximum number of characters of a filter or a rule."""

_DEEPEST: Final = 50
"""Maximum depth of nested brackets and `not`."""

_SHOWN: Final = 200


class FilterError(ValueError):
    """Raised if a text is not a valid filter. The message names the column of the error.

    Attributes:
        what: kind of text that was expected, such as `filter` or `rule`. The message contains it.
        column: column of the error. The first column is 1.
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
    """Recursive descent parser for the grammar in `filter`, with one method per rule.

    Args:
        text: text of the filter.

    Attributes:
        words: pairs of a field and a word, as in `Filter.words`, that were read until now.
    """

    wrong = FilterError

    def __init__(self, text: str) -> None:
        self._text = text
        self._signals: set[str] = set()
        self.words: set[tuple[str, str]] = set()
        self._nodes: set[range] = set()
        if len(text) > _LONGEST:
            raise self.wrong(text, _LONGEST, f"it has {len(text)} characters, at most {_LONGEST}")
        self._tokens, self._depth = tokens_of(text), 0

    def parse(self) -> Filter:
        """Read the filter. Raise FilterError if the text is not a filter."""
        test = self._or()
        if self._next.text:
            raise self._error(f"{self._next.text!r} after the end; join terms by 'and' or 'or'")
        return Filter(self._text, test, frozenset(self._signals), frozenset(self.words))

    @property
    def _next(self) -> Token:
        return self._tokens[0]

    def _take(self, *words: str) -> bool:
        """Read the next token if it is one of these."""
        if self._next.text not in words:
            return False
        del self._tokens[0]
        return True

    def _error(self, reason: str) -> FilterError:
        return self.wrong(self._text, self._next.column, reason)

    def _or(self) -> Test:
        return self._joined(any, self._and, "or", ",")

    def _and(self) -> Test:
        return self._joined(all, self._not, "and")

    def _joined(
        self, holds: Callable[[Iterable[bool]], bool], term: Callable[[], Test], *words: str
    ) -> Test:
        tests = [term()]
        while self._take(*words):
            tests.append(term())
        if len(tests) == 1:
            return tests[0]
        return lambda record, decoded: holds(test(record, decoded) for test in tests)

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
        """Read node-IDs such as 3 or 3-5."""
        match = _NODES.fullmatch(self._next.text)
        nodes = range(int(match[1]), int(match[2] or match[1]) + 1) if match else range(0)
        if not nodes or nodes[0] < 1 or nodes[-1] > _HIGHEST_NODE:
            came = repr(self._next.text) if self._next.text else "nothing"
            order = "; the lower one stands first" if match and not nodes else ""
            raise self._error(f"{came} is no node-ID 1 to {_HIGHEST_NODE}, as 3 or 3-5{order}")
        del self._tokens[0]
        self._nodes.add(nodes)
        return nodes

    def _node(self) -> Test:
        """Read the text after `node`, which is node-IDs, and an NMT state if there is one."""
        nodes, word = self._node_ids(), self._next.text
        if word not in NMT_STATES:
            return lambda record, decoded: decoded.node in nodes
        del self._tokens[0]
        self._signals |= {_state_path(node) for node in nodes}
        return _state_test(nodes, NMT_STATES[word])

    def _plain_term(self) -> Test:
        word = self._next.text
        word = _ALIASES.get(word, word)
        if not word or word in _RESERVED or not re.match(r"[\w#]", word):
            raise self._error("a term is missing, as emcy, node=3, 181-18F or statusword.fault")
        if word in _FIELDS or word in _WORDS:
            del self._tokens[0]
            if word == "node" and self._next.text[:1].isdecimal():
                return self._node()
            return self._field(word)
        test = self._id_test(word) or _kind_test(word)
        if test is None:
            return self._signal(word)
        del self._tokens[0]
        if word == "sdo" and self._take("["):
            test = self._object()
            self._expect("]")
        return test

    def _id_test(self, word: str) -> Test | None:
        """Return the test of CAN-IDs, or None for other words."""
        if _RULE.fullmatch(word):
            return _candump_test(CandumpFilter.parse(word))
        if errors := _ERRORS.fullmatch(word):
            return _error_test(int(errors[1], 16))
        low, dash, high = word.partition("-")
        if not _CAN_ID.fullmatch(low) or (dash and not _CAN_ID.fullmatch(high)):
            return None
        high = high or low
        extended = len(low) == 8
        numbers = int(low, 16), int(high, 16)
        most = EXTENDED_MAX if extended else STANDARD_MAX
        if len(low) != len(high) or not numbers[0] <= numbers[1] <= most:
            raise self._error(f"{word} is no range of CAN-IDs like 181-18F")
        return _range_test(*numbers, extended=extended)

    def _object(self) -> Test:
        match = _OBJECT.fullmatch(self._next.text)
        if match is None:
            raise self._error(f"{self._next.text!r} is no object like 6040h or 0x1018:1")
        del self._tokens[0]
        return _object_test(int(match[1], 16), int(match[2], 16) if match[2] else None)

    def _field(self, name: str) -> Test:
        sign, value = self._comparison(name)
        if name in _WORDS:
            if sign not in _EQUALITIES:
                raise self._error(f"{name} can be compared by = and != alone")
            value = _ALIASES.get(value, value)
            if not _is_word(name, value):
                words = KNOWN_WORDS[name]
                meant = [f"; did you mean {word!r}?" for word in closest(value, words)]
                if meant or name not in _FREE:
                    said = f"{name} is never {value!r}, but {', '.join(words)}"
                    raise self._error(said + "".join(meant))
                self.words.add((name, value))
            del self._tokens[0]
            return _word_test(name, sign, value)
        wanted = _hexadecimal(value) if name == "id" else number(value)
        if wanted is None:
            raise self._error(f"{value!r} is no number")
        if _never_holds(name, sign, wanted):
            low, high = _RANGES[name][0], _RANGES[name][-1]
            ends = f"{low:X} to {high:X}" if name == "id" else f"{low} to {high}"
            raise self._error(f"{name} is {ends}, never {sign.strip('=!')}{value}")
        del self._tokens[0]
        return _field_test(name, COMPARISONS[sign], wanted)

    def _comparison(self, name: str) -> tuple[str, str]:
        """Read the sign. Return it with the value after it, which is not consumed yet."""
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
        if node is not None and node not in _RANGES["node"]:
            raise self._error(f"{node} is no node-ID 1 to {_HIGHEST_NODE}")
        del self._tokens[0]
        return self._compared(word, _EQUALITIES)

    def _compared(self, name: str, with_words: Collection[str]) -> Test:
        """Read the comparison of a signal, if there is one. Some signs also compare words."""
        self._signals.add(name)
        if self._next.text not in COMPARISONS:
            return signal_test(name)
        sign, value = self._comparison(name)
        if number(value) is None and sign not in with_words:
            raise self._error(f"{value!r} is no number")
        del self._tokens[0]
        return signal_test(name, sign, value)


def _hexadecimal(text: str) -> int | None:
    digits = text.removeprefix("0x").removesuffix("h")
    return int(digits, 16) if _HEX_DIGITS.fullmatch(digits) else None


@dataclass(frozen=True, slots=True)
class Filter:
    """A parsed filter, which selects frames by CAN-ID, node, kind or the values of signals.

    Attributes:
        text: filter as the user has written it.
        matches: function that returns whether a frame passes the filter.
        signals: names of the signals in the filter, so that signals that never occur can be
            reported.
        words: unknown words that the filter compares with a field, as in `kind=word`. Each is a
            pair of the field (`kind`) and the word. A word is unknown if no built-in decoder uses
            it as a value of the field. An unknown word may be misspelt. It is correct if the
            decoder of an installed package uses it.
    """

    text: str
    matches: Test
    signals: frozenset[str] = frozenset()
    words: frozenset[tuple[str, str]] = frozenset()


def parse_filter(text: str) -> Filter:
    """Parse a filter of the user, as in the option `-F`.

    Args:
        text: filter in the language of this module, or in the notation of candump.

    Raises:
        FilterError: the text is not a filter. The message names the column of the error.
    """
    try:
        chosen = CandumpFilter.parse(text)
    except ValueError:
        return FilterParser(text).parse()
    return Filter(text, _candump_test(chosen))
