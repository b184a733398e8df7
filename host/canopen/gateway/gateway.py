"""What a gateway does for one client: SDO, NMT and its own settings (CiA 309-3, ASCII mapping)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Final

from tickrig.host.canopen.commissioning.node_bus import NodeBus
from tickrig.host.canopen.errors import SdoAborted, SdoTimeout
from tickrig.host.canopen.gateway.data_types import NAMES, data_type, decode, encode
from tickrig.host.canopen.gateway.gateway_error import ErrorCode, GatewayError
from tickrig.host.canopen.gateway.lss_requests import LSS_HELP, LSS_VERBS, carry_out
from tickrig.host.canopen.gateway.request import (
    Request,
    check_count,
    number,
    one_of,
    parse_request,
    sequence_of,
)
from tickrig.host.canopen.sdo_transfer import download, upload
from tickrig.host.links.errors import LinkClosed
from tickrig.wire.canopen.nmt import NmtCommand
from tickrig.wire.canopen.sdo.abort import AbortCode, describe_abort

OK: Final = "OK"
NODES: Final = 127
MOST_TIMEOUT_MS: Final = 0xFFFF
NMT_VERBS: Final = {
    "start": NmtCommand.START,
    "stop": NmtCommand.STOP,
    "preop": NmtCommand.ENTER_PRE_OPERATIONAL,
    "preoperational": NmtCommand.ENTER_PRE_OPERATIONAL,
}
RESETS: Final = {
    "node": NmtCommand.RESET_NODE,
    "comm": NmtCommand.RESET_COMMUNICATION,
    "communication": NmtCommand.RESET_COMMUNICATION,
}
SETTINGS: Final = ("network", "node", "sdo_timeout")
HELP: Final = """\
[SEQUENCE] [[NET] NODE] r[ead] INDEX SUBINDEX [TYPE]
[SEQUENCE] [[NET] NODE] w[rite] INDEX SUBINDEX TYPE VALUE
[SEQUENCE] [[NET] NODE] start | stop | preop[erational]   NODE 0: all
[SEQUENCE] [[NET] NODE] reset node | comm[unication]
[SEQUENCE] [NET] set network | node | sdo_timeout VALUE   ms
[SEQUENCE] info version
[SEQUENCE] help [datatype | lss]
Answers: [SEQUENCE] OK | VALUE | ERROR:CODE #TEXT
Numbers are decimal, or hexadecimal as 0x1017. What follows # is a comment."""
TYPES_HELP: Final = f"""\
{" ".join(NAMES)}
b: 0 or 1; i, u: integers; x: the same as u, shown hexadecimal; r: reals
vs: visible string, in double quotes; os, us, d: base64; hex: bytes as 01 AB"""


class Gateway:
    """Answers the lines of one client; its settings are its own.

    Not emulated: PDO and emergency commands, device commands such as `set heartbeat`, events
    that nobody asked for, SDO block transfer.

    Args:
        bus: the net.
        net: its number.
        version: of the gateway, for `info version`.
    """

    def __init__(self, bus: NodeBus, net: int, version: str) -> None:
        self._bus, self._net, self._version = bus, net, version
        self._node: int | None = None
        self._timeout_us = 500_000
        self._verbs: Mapping[str, Callable[[Request], str]] = {
            **dict.fromkeys(LSS_VERBS, self._lss),
            **dict.fromkeys(("r", "read"), self._read),
            **dict.fromkeys(("w", "write"), self._write),
            **dict.fromkeys((*NMT_VERBS, "reset"), self._command),
            "set": self._set,
            "info": self._info,
            "help": self._help,
        }

    def answer(self, line: str) -> str:
        """Answer a line; what comes has no end of line. Empty for an empty line and a comment."""
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
            reason = f"{ErrorCode.LOST_CONNECTION} #{error}"
        return f"[{sequence_of(line)}] ERROR:{' '.join(reason.split())}"

    def _carry_out(self, request: Request) -> str:
        verb = self._verbs.get(request.verb)
        if verb is None:
            raise GatewayError(ErrorCode.NOT_SUPPORTED, f"{request.verb!r} is not supported")
        return verb(request)

    def _node_of(self, request: Request, least: int) -> int:
        """Return the node that a command is for; 0 is all of them."""
        *net, node = request.numbers or (-1,)
        self._check_net(net)
        if node == -1:
            if self._node is None:
                raise GatewayError(ErrorCode.NO_DEFAULT_NODE)
            return self._node
        if not least <= node <= NODES:
            text = f"node {node} is not {least}..{NODES}"
            raise GatewayError(ErrorCode.UNSUPPORTED_NODE, text)
        return node

    def _check_net(self, net: list[int]) -> None:
        if net and net[0] != self._net:
            text = f"there is no net {net[0]}, this one is {self._net}"
            raise GatewayError(ErrorCode.UNSUPPORTED_NET, text)

    def _read(self, request: Request) -> str:
        node = self._node_of(request, 1)
        check_count(request, 2, 3)
        index, sub = _object(request)
        name = data_type(request.words[2]) if len(request.words) > 2 else ""
        return decode(name, self._bus.run(node, upload(index, sub), self._timeout_us))

    def _write(self, request: Request) -> str:
        node = self._node_of(request, 1)
        check_count(request, 4, None)
        index, sub = _object(request)
        data = encode(data_type(request.words[2]), request.words[3:])
        self._bus.run(node, download(index, sub, data), self._timeout_us)
        return OK

    def _command(self, request: Request) -> str:
        node = self._node_of(request, 0)
        if request.verb == "reset":
            check_count(request, 1, 1)
            command = RESETS[one_of(request.words[0], RESETS, "reset")]
        else:
            check_count(request, 0, 0)
            command = NMT_VERBS[request.verb]
        self._bus.command(command, node)
        return OK

    def _lss(self, request: Request) -> str:
        self._check_net(list(request.numbers))
        return carry_out(self._bus, request)

    def _set(self, request: Request) -> str:
        self._check_net(list(request.numbers))
        check_count(request, 1, None)
        if (name := request.words[0].lower()) not in SETTINGS:
            raise GatewayError(ErrorCode.NOT_SUPPORTED, f"set {name!r} is not supported")
        check_count(request, 2, 2)
        value = request.words[1]
        match name:
            case "network":
                self._check_net([number(value, 0xFFFF, "net")])
            case "node":
                self._node = number(value, NODES, "node", 1)
            case _:
                self._timeout_us = 1_000 * number(value, MOST_TIMEOUT_MS, "time-out", 1)
        return OK

    def _info(self, request: Request) -> str:
        """Say vendor-ID, product code, revision, serial number, class, protocol, version."""
        check_count(request, 1, 1)
        one_of(request.words[0], ("version",), "info")
        return f"0x00000000 0x00000000 0.0 0 0 3.0 {self._version}"

    def _help(self, request: Request) -> str:
        check_count(request, 0, 1)
        what = one_of(request.words[0], ("datatype", "lss"), "help") if request.words else ""
        text = {"": HELP, "datatype": TYPES_HELP, "lss": LSS_HELP}[what]
        return "\n" + text


def _numbered(request: Request, text: str) -> str:
    """Return an answer with its number; remarks stand in lines of their own before it."""
    remarks, end, value = text.rpartition("\n") if text.startswith("#") else ("", "", text)
    return f"{remarks}{end}[{request.sequence}] {value}"


def _object(request: Request) -> tuple[int, int]:
    index, sub, *_ = request.words
    return number(index, 0xFFFF, "index"), number(sub, 0xFF, "sub-index")
