"""LSS over a gateway: node-ID and bit rate of slaves (CiA 309-3, CiA 305)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.host.canopen.commissioning.lss_master import SCAN_US, LssFailed, LssMaster
from tickrig.host.canopen.commissioning.node_bus import NodeBus
from tickrig.host.canopen.gateway.gateway_error import ErrorCode, GatewayError
from tickrig.host.canopen.gateway.request import Request, check_count, number
from tickrig.wire.canopen.lss import BIT_RATES, STANDARD_TABLE, LssAddress, LssCommand, LssMode

OK: Final = "OK"
UNCONFIGURED: Final = 255
NODES: Final = 127
MOST_DELAY_MS: Final = 0xFFFF
MOST: Final = 0xFFFF_FFFF
FAILED: Final = {
    LssCommand.CONFIGURE_NODE_ID: ErrorCode.LSS_NODE_ID,
    LssCommand.CONFIGURE_BIT_TIMING: ErrorCode.LSS_BIT_RATE,
    LssCommand.STORE: ErrorCode.LSS_STORE,
}
SPECIFIC: Final = 0xFF
SCANS: Final = ("_lss_fastscan", "lss_allnodes")
LSS_HELP: Final = """\
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


def carry_out(bus: NodeBus, request: Request) -> str:
    """Carry out a command of `LSS_VERBS`, and return what is answered.

    Raises:
        GatewayError: it is none, or the slave refuses or does not answer.
        LinkClosed: the bus is gone.
    """
    scan_us = SCAN_US
    if request.verb in SCANS and request.words:
        scan_us = 1_000 * number(request.words[0], MOST_DELAY_MS, "time-out", 1)
    try:
        return _CARRIED_OUT[request.verb](LssMaster(bus, scan_us=scan_us), request)
    except LssFailed as error:
        code = ErrorCode.TIME_OUT
        if error.code and error.command is not None:
            code = FAILED.get(error.command, ErrorCode.LSS_MANUFACTURER)
        if error.code == SPECIFIC:
            code = ErrorCode.LSS_MANUFACTURER
        raise GatewayError(code, str(error)) from None


def _switch_all(lss: LssMaster, request: Request) -> str:
    (mode,) = _numbers(request, 1)
    lss.switch_all(LssMode(_within(mode, 0, 1)))
    return OK


def _select(lss: LssMaster, request: Request) -> str:
    if not lss.select(LssAddress(*_numbers(request, 4))):
        raise GatewayError(ErrorCode.TIME_OUT, "no slave has this address")
    return OK


def _set_node(lss: LssMaster, request: Request) -> str:
    (node_id,) = _numbers(request, 1)
    lss.configure_node_id(node_id if node_id == UNCONFIGURED else _within(node_id, 1, NODES))
    return OK


def _configure_bit_rate(lss: LssMaster, request: Request) -> str:
    table, index = _numbers(request, 2)
    if table != STANDARD_TABLE or index not in BIT_RATES:
        raise GatewayError(ErrorCode.LSS_BIT_RATE, f"table {table} has no bit rate {index}")
    lss.configure_bit_rate(BIT_RATES[index])
    return OK


def _activate(lss: LssMaster, request: Request) -> str:
    (delay_ms,) = _numbers(request, 1)
    lss.activate_bit_rate(_within(delay_ms, 0, MOST_DELAY_MS))
    return OK


def _store(lss: LssMaster, request: Request) -> str:
    _numbers(request, 0)
    lss.store()
    return OK


def _address(lss: LssMaster, request: Request) -> str:
    wanted = _numbers(request, 0, 1)
    address = lss.address()
    return f"0x{address[_within(wanted[0], 0, 3)]:08X}" if wanted else _text(address)


def _node(lss: LssMaster, request: Request) -> str:
    _numbers(request, 0)
    return f"0x{lss.node_id():02X}"


def _scan(lss: LssMaster, request: Request) -> str:
    _numbers(request, 0, 1)
    if (address := lss.fastscan()) is None:
        raise GatewayError(ErrorCode.TIME_OUT, "no slave is without a node-ID")
    return _text(address)


def _all_nodes(lss: LssMaster, request: Request) -> str:
    """Give each slave without a node-ID one; what a slave was given stands in front of OK."""
    words = _numbers(request, 0, 3)
    if len(words) == 2:
        raise GatewayError(ErrorCode.SYNTAX, "with the first node stands 0 or 1: store or not")
    (node_id, store), said = words[1:] or (2, 1), list[str]()
    with lss.at_work():
        while (address := lss.fastscan()) is not None:
            lss.configure_node_id(_within(node_id, 1, NODES))
            if store:
                lss.store()
            lss.switch_all(LssMode.WAITING)
            said.append(f"# Node-ID {node_id} assigned to: {_text(address)}")
            node_id += 1
    return "\n".join([*said, OK])


_CARRIED_OUT: Final[dict[str, Callable[[LssMaster, Request], str]]] = {
    "lss_switch_glob": _switch_all,
    "lss_switch_sel": _select,
    "lss_set_node": _set_node,
    "lss_conf_bitrate": _configure_bit_rate,
    "lss_activate_bitrate": _activate,
    "lss_store": _store,
    "lss_inquire_addr": _address,
    "lss_get_node": _node,
    "_lss_fastscan": _scan,
    "lss_allnodes": _all_nodes,
}
LSS_VERBS: Final = tuple(_CARRIED_OUT)


def _numbers(request: Request, least: int, most: int | None = None) -> tuple[int, ...]:
    check_count(request, least, least if most is None else most)
    return tuple(number(word, MOST, "number") for word in request.words)


def _within(value: int, least: int, most: int) -> int:
    if not least <= value <= most:
        raise GatewayError(ErrorCode.SYNTAX, f"{value} is not {least}..{most}")
    return value


def _text(address: LssAddress) -> str:
    return " ".join(f"0x{part:08X}" for part in address)
