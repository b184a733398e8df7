r"""A gateway for one client: SDO, NMT and its own settings (CiA 309-3, ASCII mapping).

The module reads lines that a client of a gateway sends (CiA 309-3, syntax of commands).

>>> request = parse_request('[7] 1 4 w 0x2000 3 vs "Don said ""go"" # 1"  # a comment')
>>> request.sequence, request.numbers, request.verb, request.words
(7, (1, 4), 'w', ('0x2000', '3', 'vs', 'Don said "go" # 1'))
>>> parse_request("# nothing") is None
True

The module also converts the data types of a gateway, which a client writes for the bytes of an
object (CiA 309-3).

>>> encode("i16", ["-2"]).hex(), decode("i16", b"\xfe\xff"), decode("x16", b"\x92\x01")
('feff', '-2', '0x0192')
>>> decode("vs", b"abc"), decode("", b"\x01\xAB")
('"abc"', '01 AB')
"""

from __future__ import annotations

import re
from base64 import b64decode, b64encode
from binascii import Error
from collections.abc import Callable, Collection, Mapping, Sequence
from enum import IntEnum
from math import isnan
from typing import ClassVar, Final, NamedTuple

from tickrig.host.canopen.commissioning.lss_master import SCAN_US, LssFailed, LssMaster
from tickrig.host.canopen.commissioning.node_bus import NodeBus
from tickrig.host.canopen.errors import SdoAborted, SdoTimeout
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.host.links.link import LinkClosed
from tickrig.host.text.names import known
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.lss import BIT_RATES, STANDARD_TABLE, LssAddress, LssCommand, LssMode
from tickrig.wire.canopen.nmt import NmtCommand
from tickrig.wire.canopen.sdo_frame import AbortCode, describe_abort
from tickrig.wire.errors import FieldError

# Why a gateway does not execute a command (CiA 309-3, internal error codes).


class _GatewayErrorCode(IntEnum):
    """Internal error code of a gateway."""

    NOT_SUPPORTED = 100
    SYNTAX = 101
    TIME_OUT = 103
    NO_DEFAULT_NODE = 105
    UNSUPPORTED_NET = 106
    UNSUPPORTED_NODE = 107
    LOST_CONNECTION = 201
    LSS_MANUFACTURER = 501
    LSS_NODE_ID = 502
    LSS_BIT_RATE = 503
    LSS_STORE = 504


OK: Final = "OK"


class GatewayError(Exception):
    """Raised if the gateway cannot execute a command of its client.

    Args:
        text: reason for the client. If it is empty, the text of the code is used.
        code: error code of CiA 309-3 that the client gets.
    """

    def __init__(self, text: str, code: _GatewayErrorCode = _GatewayErrorCode.SYNTAX) -> None:
        super().__init__(text)
        self.code = code


_SEQUENCE: Final = re.compile(r"\s*\[([0-9]{1,10})\]")
_WORD: Final = re.compile(r'\s*(?:"((?:[^"]|"")*)"(?=\s|$)|(#).*|([^\s"]\S*))', re.DOTALL)
_MAX_NUMBER: Final = 0xFFFF_FFFF
_MOST_NUMBERS: Final = 2


class _GatewayRequest(NamedTuple):
    """A command of a client.

    Attributes:
        sequence: number that the answer to the command repeats.
        numbers: numbers before the verb: none, a node, or a net and a node.
        verb: verb in lower case.
        words: words after the verb. Strings have no quotes.
    """

    sequence: int
    numbers: tuple[int, ...]
    verb: str
    words: tuple[str, ...]


def _sequence_of(line: str) -> int:
    """Return the sequence number of a line, or 0 if the line has none."""
    found = _SEQUENCE.match(line)
    return int(found[1]) if found and int(found[1]) <= _MAX_NUMBER else 0


def parse_request(line: str) -> _GatewayRequest | None:
    """Parse a command line of a gateway client (CiA 309-3), such as `[1] 4 read 0x1008 0 vs`.

    The result is None for an empty line and for a comment.

    Raises:
        GatewayError: the line is not a valid command.
    """
    if not line.strip() or line.lstrip().startswith("#"):
        return None
    head = _SEQUENCE.match(line)
    if head is None or int(head[1]) > _MAX_NUMBER:
        raise GatewayError("a command begins with its number, for example [1]")
    words, numbers = _words(line[head.end() :]), list[int]()
    while words and words[0][:1].isdecimal():
        if len(numbers) == _MOST_NUMBERS:
            raise GatewayError("at most net and node may precede a command")
        numbers.append(number(words.pop(0), _MAX_NUMBER, "number"))
    if not words:
        raise GatewayError("the command is missing")
    return _GatewayRequest(int(head[1]), tuple(numbers), words[0].lower(), tuple(words[1:]))


def number(word: str, most: int, what: str, least: int = 0) -> int:
    """Read a decimal or hexadecimal number. The text of a GatewayError names the quantity."""
    try:
        value = int(word, 16) if word[:2].lower() == "0x" else int(word)
    except ValueError:
        value = -1
    if not (least <= value <= most and word.isascii() and word.isalnum()):
        raise GatewayError(f"{what} {word!r} is not {least}..{most}")
    return value


def _one_of(word: str, words: Collection[str], what: str) -> str:
    """Return one of the known words, in lower case."""
    if (lower := word.lower()) not in words:
        raise GatewayError(f"{what} {word!r}; known: {known(words)}")
    return lower


def _check_count(request: _GatewayRequest, least: int, most: int | None) -> None:
    """Refuse a command whose number of words after the verb is not from `least` to `most`."""
    count = len(request.words)
    if count < least or (most is not None and count > most):
        raise GatewayError(f"{request.verb} with {count} arguments; see help")


def _words(text: str) -> list[str]:
    words, at = list[str](), 0
    text = text.rstrip()
    while at < len(text):
        found = _WORD.match(text, at)
        if found is None:
            raise GatewayError("a quote is not closed")
        if found[2]:
            break
        words.append(found[3] if found[1] is None else found[1].replace('""', '"'))
        at = found.end()
    return words


HEX: Final = "hex"
"""Data type for bytes, which is the type of CANopenNode, and the format if no type is given."""

_SIZES: Final = range(8, 65, 8)
NUMBERS: Final = {
    "b": DataType.BOOLEAN,
    **{f"i{bits}": DataType[f"INTEGER{bits}"] for bits in _SIZES},
    **{f"u{bits}": DataType[f"UNSIGNED{bits}"] for bits in _SIZES},
    **{f"x{bits}": DataType[f"UNSIGNED{bits}"] for bits in (8, 16, 32, 64)},
    "r32": DataType.REAL32,
    "r64": DataType.REAL64,
}
REALS: Final = ("r32", "r64")
BASE64: Final = ("os", "us", "d")
_STRING: Final = "vs"
_NAMES: Final = (*NUMBERS, _STRING, *BASE64, HEX)
_UNSHOWN: Final = str.maketrans("", "", "\0\r\n")


def _data_type(word: str) -> str:
    """Return the name of a data type in lower case. Raise GatewayError if the type is unknown."""
    return _one_of(word, _NAMES, "data type")


def encode(name: str, words: Sequence[str]) -> bytes:
    """Convert the value in a gateway command to the bytes of the object.

    Args:
        name: name of a data type in CiA 309-3, one of `_NAMES`.
        words: value as the client wrote it. It is a single word except for the type `hex`.

    Raises:
        GatewayError: the words are not a value of this type.
    """
    text = " ".join(words)
    try:
        if name == HEX:
            return bytes.fromhex(text)
        (word,) = words
        if name == _STRING:
            return word.encode("latin-1")
        if name in BASE64:
            return b64decode(word, validate=True)
        return NUMBERS[name].encode(float(word) if name in REALS else _integer(word))
    except (ValueError, FieldError, Error):
        raise GatewayError(f"{text!r} is not a value of type {name}") from None


def decode(name: str, data: bytes) -> str:
    """Convert the bytes of an object to the text that a gateway answer contains.

    Bytes that do not fit the data type are shown in hexadecimal.

    Args:
        name: name of a data type in CiA 309-3, one of `_NAMES`, or empty if the client named none.
        data: bytes of the object.
    """
    if name == _STRING:
        return '"' + data.decode("latin-1").translate(_UNSHOWN).replace('"', '""') + '"'
    if name in BASE64:
        return b64encode(data).decode("ascii")
    if name in ("", HEX) or len(data) != NUMBERS[name].size:
        return data.hex(" ").upper()
    value = NUMBERS[name].decode(data)
    if isinstance(value, float):
        return "nan" if isnan(value) else f"{value:g}"
    if name.startswith("x") and isinstance(value, int):
        return f"0x{value:0{2 * len(data)}X}"
    return str(value)


def _integer(word: str) -> int:
    digits = word.removeprefix("-")
    if not (digits.isascii() and digits.isalnum()):
        raise ValueError(word)
    value = int(digits, 16) if digits[:2].lower() == "0x" else int(digits)
    return -value if word.startswith("-") else value


# LSS over a gateway: node-ID and bit rate of slaves (CiA 309-3, CiA 305).

_UNCONFIGURED: Final = 255
_MOST_NODE_ID: Final = 127
_MOST_DELAY_MS: Final = 0xFFFF
_FAILED: Final = {
    LssCommand.CONFIGURE_NODE_ID: _GatewayErrorCode.LSS_NODE_ID,
    LssCommand.CONFIGURE_BIT_TIMING: _GatewayErrorCode.LSS_BIT_RATE,
    LssCommand.STORE: _GatewayErrorCode.LSS_STORE,
}
_SPECIFIC: Final = 0xFF
_SCANS: Final = ("_lss_fastscan", "lss_allnodes")
_LSS_HELP: Final = """\
[SEQUENCE] [NET] lss_switch_glob 0|1                  waiting, configuration
[SEQUENCE] [NET] lss_switch_sel VENDOR PRODUCT REVISION SERIAL
[SEQUENCE] [NET] lss_set_node NODE                    1..127, 255 for none
[SEQUENCE] [NET] lss_conf_bitrate TABLE INDEX         0 1M, 1 800k, 2 500k, 3 250k, 4 125k,
[SEQUENCE] [NET] lss_activate_bitrate DELAY_MS        6 50k, 7 20k, 8 10k
[SEQUENCE] [NET] lss_store
[SEQUENCE] [NET] lss_inquire_addr [0..3]              vendor, product, revision, serial
[SEQUENCE] [NET] lss_get_node
[SEQUENCE] [NET] _lss_fastscan [TIMEOUT_MS]           finds a slave without a node-ID
[SEQUENCE] [NET] lss_allnodes [TIMEOUT_MS [FIRST_NODE STORE]]"""


def carry_out(bus: NodeBus, request: _GatewayRequest) -> str:
    """Execute an LSS command of a gateway client (CiA 309-3). Return the answer.

    Raises:
        GatewayError: the command is not valid, or an LSS slave refuses it or does not answer.
        LinkClosed: the connection to the bus is lost.
    """
    scan_us = SCAN_US
    if request.verb in _SCANS and request.words:
        scan_us = 1_000 * number(request.words[0], _MOST_DELAY_MS, "time-out", 1)
    do, least, most = _CARRIED_OUT[request.verb]
    _check_count(request, least, most)
    numbers = [number(word, _MAX_NUMBER, "number") for word in request.words]
    try:
        return do(LssMaster(bus, scan_us=scan_us), *numbers) or OK
    except LssFailed as error:
        code = _GatewayErrorCode.TIME_OUT
        if error.code and error.command is not None:
            code = _FAILED.get(error.command, _GatewayErrorCode.LSS_MANUFACTURER)
        if error.code == _SPECIFIC:
            code = _GatewayErrorCode.LSS_MANUFACTURER
        raise GatewayError(str(error), code) from None


def _switch_all(lss: LssMaster, mode: int) -> None:
    lss.switch_all(LssMode(_within(mode, 0, 1)))


def _select(lss: LssMaster, *address: int) -> None:
    if not lss.select(LssAddress(*address)):
        raise GatewayError("no slave has this address", _GatewayErrorCode.TIME_OUT)


def _set_node(lss: LssMaster, node_id: int) -> None:
    if node_id != _UNCONFIGURED:
        _within(node_id, 1, _MOST_NODE_ID)
    lss.configure_node_id(node_id)


def _configure_bit_rate(lss: LssMaster, table: int, index: int) -> None:
    if table != STANDARD_TABLE or index not in BIT_RATES:
        raise GatewayError(f"table {table} has no bit rate {index}", _GatewayErrorCode.LSS_BIT_RATE)
    lss.configure_bit_rate(BIT_RATES[index])


def _activate(lss: LssMaster, delay_ms: int) -> None:
    lss.activate_bit_rate(_within(delay_ms, 0, _MOST_DELAY_MS))


def _address(lss: LssMaster, *wanted: int) -> str:
    address = lss.address()
    return f"0x{address[_within(wanted[0], 0, 3)]:08X}" if wanted else _text(address)


def _node(lss: LssMaster) -> str:
    return f"0x{lss.node_id():02X}"


def _scan(lss: LssMaster, _timeout_ms: int = 0) -> str:
    if (address := lss.fastscan()) is None:
        raise GatewayError("no slave lacks a node-ID", _GatewayErrorCode.TIME_OUT)
    return _text(address)


def _all_nodes(lss: LssMaster, *numbers: int) -> str:
    """Assign a node-ID to each slave without one. List the node-IDs before OK."""
    if len(numbers) == 2:
        raise GatewayError("the first node is followed by 0 or 1: store or not")
    (node_id, store), said = numbers[1:] or (2, 1), list[str]()
    with lss.at_work():
        while (address := lss.fastscan()) is not None:
            lss.configure_node_id(_within(node_id, 1, _MOST_NODE_ID))
            if store:
                lss.store()
            lss.switch_all(LssMode.WAITING)
            said.append(f"# Node-ID {node_id} assigned to: {_text(address)}")
            node_id += 1
    return "\n".join([*said, OK])


_CARRIED_OUT: Final[dict[str, tuple[Callable[..., str | None], int, int]]] = {
    "lss_switch_glob": (_switch_all, 1, 1),
    "lss_switch_sel": (_select, 4, 4),
    "lss_set_node": (_set_node, 1, 1),
    "lss_conf_bitrate": (_configure_bit_rate, 2, 2),
    "lss_activate_bitrate": (_activate, 1, 1),
    "lss_store": (LssMaster.store, 0, 0),
    "lss_inquire_addr": (_address, 0, 1),
    "lss_get_node": (_node, 0, 0),
    "_lss_fastscan": (_scan, 0, 1),
    "lss_allnodes": (_all_nodes, 0, 3),
}
"""Functions of the verbs, and how many numbers follow a verb: at least, and at most.

A function without an answer of its own is answered by OK.
"""


def _within(value: int, least: int, most: int) -> int:
    if not least <= value <= most:
        raise GatewayError(f"{value} is not {least}..{most}")
    return value


def _text(address: LssAddress) -> str:
    return " ".join(f"0x{part:08X}" for part in address)


_NODES: Final = 127
_MOST_TIMEOUT_MS: Final = 0xFFFF
_NMT_VERBS: Final = {
    "start": NmtCommand.START,
    "stop": NmtCommand.STOP,
    "preop": NmtCommand.ENTER_PRE_OPERATIONAL,
    "preoperational": NmtCommand.ENTER_PRE_OPERATIONAL,
}
_RESETS: Final = {
    "node": NmtCommand.RESET_NODE,
    "comm": NmtCommand.RESET_COMMUNICATION,
    "communication": NmtCommand.RESET_COMMUNICATION,
}
_SETTINGS: Final = ("network", "node", "sdo_timeout")
_HELP: Final = """\
[SEQUENCE] [[NET] NODE] r[ead] INDEX SUBINDEX [TYPE]
[SEQUENCE] [[NET] NODE] w[rite] INDEX SUBINDEX TYPE VALUE
[SEQUENCE] [[NET] NODE] start | stop | preop[erational]   NODE 0: all
[SEQUENCE] [[NET] NODE] reset node | comm[unication]
[SEQUENCE] [NET] set network | node | sdo_timeout VALUE   ms
[SEQUENCE] info version
[SEQUENCE] help [datatype | lss]
Answers: [SEQUENCE] OK | VALUE | ERROR:CODE #TEXT
Numbers are decimal, or hexadecimal as 0x1017. What follows # is a comment."""
_TYPES_HELP: Final = f"""\
{" ".join(_NAMES)}
b: 0 or 1; i, u: integers; x: the same as u, shown hexadecimal; r: reals
vs: visible string, in double quotes; os, us, d: base64; hex: bytes as 01 AB"""


class Gateway:
    """CANopen gateway for one client, which executes its command lines (CiA 309-3, ASCII mapping).

    Each client has its own settings. The gateway supports none of these: PDO and emergency
    commands, device commands such as `set heartbeat`, unsolicited events, SDO block transfer.

    Args:
        bus: bus on which the gateway executes the commands.
        net: number by which clients address this bus.
        version: version that the gateway returns for the command `info version`.
    """

    LSS_VERBS: ClassVar[tuple[str, ...]] = tuple(_CARRIED_OUT)
    """Words of CiA 309-3 that begin an LSS command."""

    def __init__(self, bus: NodeBus, net: int, version: str) -> None:
        self._bus, self._net, self._version = bus, net, version
        self._node: int | None = None
        self._timeout_us = 500_000
        self._verbs: Mapping[str, Callable[[_GatewayRequest], str]] = {
            **dict.fromkeys(self.LSS_VERBS, self._lss),
            **dict.fromkeys(("r", "read"), self._read),
            **dict.fromkeys(("w", "write"), self._write),
            **dict.fromkeys((*_NMT_VERBS, "reset"), self._command),
            "set": self._set,
            "info": self._info,
            "help": self._help,
        }

    def answer(self, line: str) -> str:
        """Execute a command line and return the answer, both without line ends.

        The answer to an empty line or a comment is empty.
        """
        try:
            request = parse_request(line)
            return "" if request is None else _numbered(request, self._carry_out(request))
        except GatewayError as error:
            reason = f"{error.code} #{error}"
        except SdoAborted as error:
            reason = f"0x{error.code:08X} #{describe_abort(error.code)}"
        except SdoTimeout:
            reason = f"0x{AbortCode.TIMEOUT:08X} #no answer within {self._timeout_us // 1_000} ms"
        except LinkClosed as error:
            reason = f"{_GatewayErrorCode.LOST_CONNECTION} #{error}"
        return f"[{_sequence_of(line)}] ERROR:{' '.join(reason.split())}"

    def _carry_out(self, request: _GatewayRequest) -> str:
        verb = self._verbs.get(request.verb)
        if verb is None:
            text = f"{request.verb!r} is not supported"
            raise GatewayError(text, _GatewayErrorCode.NOT_SUPPORTED)
        return verb(request)

    def _node_of(self, request: _GatewayRequest, least: int) -> int:
        """Return the node-ID that a command addresses. 0 stands for all nodes."""
        *net, node = request.numbers or (-1,)
        self._check_net(net)
        if node == -1:
            if self._node is None:
                raise GatewayError("no default node is set", _GatewayErrorCode.NO_DEFAULT_NODE)
            return self._node
        if not least <= node <= _NODES:
            text = f"node {node} is not {least}..{_NODES}"
            raise GatewayError(text, _GatewayErrorCode.UNSUPPORTED_NODE)
        return node

    def _check_net(self, net: list[int]) -> None:
        if net and net[0] != self._net:
            text = f"there is no net {net[0]}, this one is {self._net}"
            raise GatewayError(text, _GatewayErrorCode.UNSUPPORTED_NET)

    def _read(self, request: _GatewayRequest) -> str:
        node = self._node_of(request, 1)
        _check_count(request, 2, 3)
        index, sub = _object(request)
        name = _data_type(request.words[2]) if len(request.words) > 2 else ""
        return decode(name, self._bus.run(node, upload(index, sub), self._timeout_us))

    def _write(self, request: _GatewayRequest) -> str:
        node = self._node_of(request, 1)
        _check_count(request, 4, None)
        index, sub = _object(request)
        data = encode(_data_type(request.words[2]), request.words[3:])
        self._bus.run(node, download(index, sub, data), self._timeout_us)
        return OK

    def _command(self, request: _GatewayRequest) -> str:
        node = self._node_of(request, 0)
        if request.verb == "reset":
            _check_count(request, 1, 1)
            command = _RESETS[_one_of(request.words[0], _RESETS, "reset")]
        else:
            _check_count(request, 0, 0)
            command = _NMT_VERBS[request.verb]
        self._bus.command(command, node)
        return OK

    def _lss(self, request: _GatewayRequest) -> str:
        self._check_net(list(request.numbers))
        return carry_out(self._bus, request)

    def _set(self, request: _GatewayRequest) -> str:
        self._check_net(list(request.numbers))
        _check_count(request, 1, None)
        if (name := request.words[0].lower()) not in _SETTINGS:
            raise GatewayError(f"set {name!r} is not supported", _GatewayErrorCode.NOT_SUPPORTED)
        _check_count(request, 2, 2)
        value = request.words[1]
        match name:
            case "network":
                self._check_net([number(value, 0xFFFF, "net")])
            case "node":
                self._node = number(value, _NODES, "node", 1)
            case _:
                self._timeout_us = 1_000 * number(value, _MOST_TIMEOUT_MS, "time-out", 1)
        return OK

    def _info(self, request: _GatewayRequest) -> str:
        """Return vendor-ID, product code, revision, serial number, class, protocol, version."""
        _check_count(request, 1, 1)
        _one_of(request.words[0], ("version",), "info")
        return f"0x00000000 0x00000000 0.0 0 0 3.0 {self._version}"

    def _help(self, request: _GatewayRequest) -> str:
        _check_count(request, 0, 1)
        what = _one_of(request.words[0], ("datatype", "lss"), "help") if request.words else ""
        text = {"": _HELP, "datatype": _TYPES_HELP, "lss": _LSS_HELP}[what]
        return "\n" + text


def _numbered(request: _GatewayRequest, text: str) -> str:
    """Return an answer with its number. Remarks are separate lines before the answer."""
    remarks, end, value = text.rpartition("\n") if text.startswith("#") else ("", "", text)
    return f"{remarks}{end}[{request.sequence}] {value}"


def _object(request: _GatewayRequest) -> tuple[int, int]:
    index, sub, *_ = request.words
    return number(index, 0xFFFF, "index"), number(sub, 0xFF, "sub-index")
