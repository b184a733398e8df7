"""What a gateway answers, line by line, with our devices behind it in virtual time."""

from __future__ import annotations

import pytest

from tests.host.canopen.commissioning.net_bench import NetBench
from tickrig.device import make_epos
from tickrig.host.canopen.commissioning.node_bus import NodeBus
from tickrig.host.canopen.gateway import Gateway
from tickrig.host.links.link import LinkClosed


@pytest.fixture
def bench() -> NetBench:
    return NetBench(make_epos(5))


@pytest.fixture
def gateway(bench: NetBench) -> Gateway:
    bench.bus.gather(100_000)
    return Gateway(bench.bus, 1, "1.2")


SESSIONS = {
    "values": [
        ("[1] 5 read 0x1000 0 u32", "[1] 131474"),
        ("[2] 5 R 0x1000 0 X32", "[2] 0x00020192"),
        ("[3] 1 5 r 4096 0", "[3] 92 01 02 00"),
        ("[4] 5 r 0x1008 0 vs", '[4] "EPOS"'),
        ("[5] 5 r 0x1008 0 os", "[5] RVBPUw=="),
        ("[6] 5 r 0x1008 0 i16", "[6] 45 50 4F 53"),
        ("[7] 5 write 0x1017 0 u16 1000  # a second", "[7] OK"),
        ("[8] 5 r 0x1017 0 u16", "[8] 1000"),
        ("[9] 5 w 0x1017 0 x16 0x00FA", "[9] OK"),
        ("[10] 5 r 0x1017 0 hex", "[10] FA 00"),
        ("[11] 5 w 0x6065 0 hex 10 27 00 00", "[11] OK"),
        ("[12] 5 r 0x6065 0 i32", "[12] 10000"),
        ("[13] 5 w 0x607A 0 i32 -0x10", "[13] OK"),
        ("[14] 5 r 0x607A 0 i32", "[14] -16"),
        ("[15] 5 w 0x1010 1 vs save", "[15] OK"),
    ],
    "settings": [
        ("[1] r 0x1017 0 u16", "[1] ERROR:105 #no default node is set"),
        ("[2] set node 5", "[2] OK"),
        ("[3] r 0x1017 0 u16", "[3] 0"),
        ("[4] set network 1", "[4] OK"),
        ("[5] set network 2", "[5] ERROR:106 #there is no net 2, this one is 1"),
        ("[6] 2 5 r 0x1017 0", "[6] ERROR:106 #there is no net 2, this one is 1"),
        ("[7] set sdo_timeout 20", "[7] OK"),
        ("[8] 9 r 0x1017 0", "[8] ERROR:0x05040000 #no answer within 20 ms"),
        ("[9] set sdo_timeout 0", "[9] ERROR:101 #time-out '0' is not 1..65535"),
        ("[10] set sdo_block 1", "[10] ERROR:100 #set 'sdo_block' is not supported"),
        ("[10] set heartbeat 5 100", "[10] ERROR:100 #set 'heartbeat' is not supported"),
        ("[10] set node", "[10] ERROR:101 #set with 1 arguments; see help"),
        ("[10] set", "[10] ERROR:101 #set with 0 arguments; see help"),
        ("[11] info version", "[11] 0x00000000 0x00000000 0.0 0 0 3.0 1.2"),
    ],
    "mistakes": [
        ("5 r 0x1000 0", "[0] ERROR:101 #a command begins with its number, for example [1]"),
        (
            "[99999999999] 5 start",
            "[0] ERROR:101 #a command begins with its number, for example [1]",
        ),
        ("[1]", "[1] ERROR:101 #the command is missing"),
        ("[1] 1 2 3 start", "[1] ERROR:101 #at most net and node may precede a command"),
        ("[1] 5 jump", "[1] ERROR:100 #'jump' is not supported"),
        ("[1] 5 r 0x10000 0", "[1] ERROR:101 #index '0x10000' is not 0..65535"),
        ("[1] 5 r 0x1000", "[1] ERROR:101 #r with 1 arguments; see help"),
        ("[1] 5 w 0x1017 0 u16 70000", "[1] ERROR:101 #'70000' is not a value of type u16"),
        ("[1] 5 w 0x1017 0 u16 1 2", "[1] ERROR:101 #'1 2' is not a value of type u16"),
        ('[1] 5 w 0x1008 0 vs "a', "[1] ERROR:101 #a quote is not closed"),
        ("[1] 128 start", "[1] ERROR:107 #node 128 is not 0..127"),
        ("[1] 0 r 0x1000 0", "[1] ERROR:107 #node 0 is not 1..127"),
        ("[1] 5 r 0x5000 0", "[1] ERROR:0x06020000 #object does not exist (06020000h)"),
        ("[1] 5 w 0x1000 0 u32 1", "[1] ERROR:0x06010002 #object is read only (06010002h)"),
        ("", ""),
        ("  # nothing", ""),
    ],
}


@pytest.mark.parametrize("lines", SESSIONS.values(), ids=SESSIONS)
def test_each_line_has_its_answer(gateway: Gateway, lines: list[tuple[str, str]]) -> None:
    assert [(line, gateway.answer(line)) for line, _ in lines] == lines


NMT = {
    "[1] 5 start": "000#0105",
    "[1] 5 stop": "000#0205",
    "[1] 5 preop": "000#8005",
    "[1] 0 preoperational": "000#8000",
    "[1] 5 reset node": "000#8105",
    "[1] 5 reset comm": "000#8205",
    "[1] 1 5 RESET communication": "000#8205",
}


@pytest.mark.parametrize("line", NMT)
def test_nmt_commands_are_sent(bench: NetBench, gateway: Gateway, line: str) -> None:
    assert gateway.answer(line) == "[1] OK"
    bench.bus.gather(10_000)
    assert NMT[line] in bench.frames


def test_a_wrong_type_of_a_value_is_told_with_those_there_are(gateway: Gateway) -> None:
    answer = gateway.answer("[3] 5 r 0x1000 0 u23")
    assert answer.startswith("[3] ERROR:101 #data type 'u23'; known: b, i8, ")


@pytest.mark.parametrize("what", ["", " datatype", " lss"])
def test_help_tells_the_commands(gateway: Gateway, what: str) -> None:
    first, *lines = gateway.answer(f"[1] help{what}").splitlines()
    assert (first, bool(lines)) == ("[1] ", True)


def test_lss_gives_nodes_their_ids() -> None:
    bench = NetBench(make_epos(255), make_epos(5))
    bench.bus.gather(100_000)
    lines = [
        ("[1] _lss_fastscan 20", "[1] 0x00000000 0x00006210 0x00010000 0x00000001"),
        ("[2] lss_get_node", "[2] 0xFF"),
        ("[3] lss_inquire_addr", "[3] 0x00000000 0x00006210 0x00010000 0x00000001"),
        ("[4] lss_inquire_addr 1", "[4] 0x00006210"),
        ("[5] lss_set_node 128", "[5] ERROR:101 #128 is not 1..127"),
        ("[6] lss_set_node 9", "[6] OK"),
        ("[7] lss_conf_bitrate 0 2", "[7] OK"),
        ("[8] lss_conf_bitrate 0 5", "[8] ERROR:503 #table 0 has no bit rate 5"),
        ("[9] lss_store", "[9] OK"),
        ("[10] lss_switch_glob 0", "[10] OK"),
        ("[11] 9 r 0x1000 0 x32", "[11] 0x00020192"),
        ("[12] lss_get_node", "[12] ERROR:103 #LSS inquire node-ID: no answer within 500 ms"),
        ("[13] lss_switch_sel 1 2 3 4", "[13] ERROR:103 #no slave has this address"),
        ("[14] _lss_fastscan", "[14] ERROR:103 #no slave lacks a node-ID"),
    ]
    gateway = Gateway(bench.bus, 1, "1.2")
    assert [(line, gateway.answer(line)) for line, _ in lines] == lines


def test_all_nodes_get_theirs_one_after_the_other() -> None:
    bench = NetBench(make_epos(255))
    bench.bus.gather(100_000)
    gateway = Gateway(bench.bus, 1, "1.2")
    assert gateway.answer("[1] lss_allnodes 20 30 1").splitlines() == [
        "# Node-ID 30 assigned to: 0x00000000 0x00006210 0x00010000 0x00000001",
        "[1] OK",
    ]
    assert gateway.answer("[2] 30 r 0x1000 0 x32") == "[2] 0x00020192"
    assert gateway.answer("[3] lss_allnodes 20 30").startswith(
        "[3] ERROR:101 #the first node is followed by"
    )


def test_a_bus_that_is_gone_is_an_answer_too(bench: NetBench) -> None:
    class Cut(NodeBus):
        def send(self, can_id: int, data: bytes) -> None:
            raise LinkClosed("cannot send on can0: no\nsuch device")

    gateway = Gateway(Cut(bench.bus._link), 1, "1.2")
    assert gateway.answer("[4] 5 start") == "[4] ERROR:201 #cannot send on can0: no such device"
