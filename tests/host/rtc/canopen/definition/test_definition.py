"""The System Definition: read, refused with its line, written back."""

from __future__ import annotations

import json
from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tickrig.host.rtc.canopen.definition import (
    BusEntry,
    DefinitionError,
    MasterEntry,
    NodeEntry,
    PdoEntry,
    PdoLink,
    PdoName,
    Role,
    RtConnection,
    SdoEntry,
    SdoPortEntry,
    StartEntry,
    SystemDefinition,
)
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.host.rtc.canopen.definition_writer import write_definition
from tickrig.wire.canopen.pdo import MappedObject
from tickrig.wire.rtc_canopen import PORT_TYPES, PortDirection

K16 = """\
bus: {channel: vcan0, bitrate: 1000000}
master: {node: 127, heartbeat_ms: 100}
nodes:
  - {id: 16, name: Palette0, eds: f-palette.eds, role: device_rtc, ports: {tpdo2: ai}}
  - {id: 32, name: Motor0, eds: motor-core-unit.eds, role: device_rtc, heartbeat_ms: 100}
sdo: [{node: 16, index: 0x6423, sub: 0, value: 1, size: 1}]
pdo_links: [{from: 16.tpdo2, to: 32.rpdo2}]
rt_connections: [{from: Palette0.ai, to: Logger0.in}]
start: {order: [32, 16], autoactivate: false}
"""
READ = SystemDefinition(
    (
        NodeEntry(16, "Palette0", "f-palette.eds", ports={"tpdo2": "ai"}),
        NodeEntry(32, "Motor0", "motor-core-unit.eds"),
    ),
    BusEntry("vcan0", bitrate=1_000_000),
    sdo=(SdoEntry(16, 0x6423, 0, 1, 1),),
    pdo_links=(PdoLink(PdoName(16, "tpdo2"), PdoName(32, "rpdo2")),),
    rt_connections=(RtConnection("Palette0.ai", "Logger0.in"),),
    start=StartEntry((32, 16)),
)
ONE = "nodes: [{id: 1, name: A, eds: a.eds}]\n"


def test_the_definition_of_the_digest_is_read() -> None:
    assert parse_definition(K16) == READ


def test_json_is_read_as_well() -> None:
    nodes = [{"id": 1, "name": "A", "eds": "a.eds"}]
    assert parse_definition(json.dumps({"nodes": nodes})) == parse_definition(ONE)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "line 1: the file is empty"),
        ("nodes: [", "line 1: not YAML: expected the node content, but found '<stream end>'"),
        ("a: \0", "line 1: not YAML: a character that no text has"),
        ("- 1", "line 1: the file is written 'key: value', this is not"),
        ("bus: {}", "line 1: the file has no 'nodes'"),
        ("nodes: 3", "line 1: nodes is a list, this is not"),
        (ONE + "nodes: []", "line 2: 'nodes' is there twice: line 1"),
        (ONE + "port: 1", "line 2: the file: 'port' is not one of: bus, master, nodes, sdo"),
        ("nodes:\n- {id: 0, name: A, eds: a}", "line 2: id: 0 is not a whole number in 1..127"),
        ("nodes:\n- {id: no, name: A, eds: a}", "line 2: id: False is not a whole number"),
        ("nodes:\n- {id: [], name: A, eds: a}", "line 2: id: 'a list' is not a whole"),
        ("nodes:\n- {id: 2026-13-01, name: A, eds: a}", "line 2: id: '2026-13-01' is not"),
        ("nodes:\n- {id: 1, eds: a}", "line 2: a node has no 'name'"),
        ("nodes:\n- {id: 1, name: 1A, eds: a}", "line 2: name: '1A' is not like Palette0"),
        ("nodes:\n- {id: 1, name: A, eds: []}", "line 2: eds is a text, this is not"),
        (
            "nodes:\n- {id: 1, name: A, eds: a}\n- {id: 1, name: B, eds: a}",
            "line 3: nodes: 1 is there twice",
        ),
        (
            "nodes:\n- {id: 1, name: A, eds: a}\n- {id: 2, name: A, eds: a}",
            "line 3: nodes: A is there twice",
        ),
        (
            "nodes:\n- {id: 1, name: A, eds: a, role: robot}",
            "line 2: role: 'robot' is not one of: device_rtc, device, drive",
        ),
        (
            "nodes:\n- {id: 1, name: A, eds: a, ports: {pdo1: x}}",
            "line 2: ports: 'pdo1' is not like tpdo2",
        ),
        (
            "nodes:\n- {id: 1, name: A, eds: a, ports: {tpdo513: x}}",
            "line 2: a node: tpdo513, there are 512 at most",
        ),
        (
            "nodes:\n- id: 1\n  name: A\n  eds: a\n  ports: {tpdo1: x, rpdo1: x}",
            "line 5: ports: 2 ports are called x",
        ),
        (
            "nodes:\n- {id: 1, name: A, eds: a, sdo_ports: {x: {index: 0x2100}}}",
            "line 2: sdo_ports.x has no 'direction'",
        ),
        (
            "nodes:\n- {id: 1, name: A, eds: a, sdo_ports: {x: {index: 1, direction: in}}}",
            "line 2: index: 1 is not a whole number in 4096..65535",
        ),
        (
            "nodes:\n- {id: 1, name: A, eds: a, sdo_ports: {x: {index: 0x2100, direction: up}}}",
            "line 2: direction: 'up' is not one of: in, out",
        ),
        (
            "nodes:\n- {id: 1, name: A, eds: a, sdo_ports: {1x: {index: 0x2100, direction: in}}}",
            "line 2: sdo_ports: '1x' is not like label",
        ),
        (
            "nodes:\n- id: 1\n  name: A\n  eds: a\n  ports: {tpdo1: x}\n  sdo_ports:\n"
            "    x: {index: 0x2100, direction: in, type: String}",
            "line 2: a node: 2 ports are called x",
        ),
        (
            "nodes:\n- id: 1\n  name: A\n  eds: a\n  pdos:\n    tpdo1: {mapping: [0x140, 0x108]}",
            "line 6: mapping: 72 bits, a PDO has 64",
        ),
        (ONE + "master: {rate_hz: 0}", "line 2: rate_hz: 0 is not a number with 0 < rate_hz"),
        (ONE + "master: {reconnect: 1}", "line 2: reconnect: 1 is not true or false"),
        (ONE + "master: {node: 1}", "line 2: master: node 1 is one of the nodes"),
        (
            ONE + "sdo:\n- {node: 2, index: 1, sub: 1, value: 1, size: 1}",
            "line 3: sdo: node 2 is not one of: 1",
        ),
        (
            ONE + "sdo:\n- {node: 1, index: 1, sub: 1, value: 1, size: 3}",
            "line 3: sdo: size 3 is not one of: 1, 2, 4, 8",
        ),
        (
            ONE + "sdo:\n- {node: 1, index: 1, sub: 1, value: 256, size: 1}",
            "line 3: sdo: 256 does not fit into size 1",
        ),
        (ONE + "pdo_links: [{from: 1.tpdo1}]", "line 2: pdo_links has no 'to'"),
        (
            ONE + "pdo_links: [{from: 1.rpdo1, to: 1.rpdo1}]",
            "line 2: from: '1.rpdo1' is not like 16.tpdo2",
        ),
        (
            ONE + "pdo_links: [{from: 1.tpdo1, to: 2.rpdo1}]",
            "line 2: to: node 2 is not one of: 1",
        ),
        (
            ONE + "rt_connections: [{from: A, to: B.in}]",
            "line 2: from: 'A' is not like Palette0.ai",
        ),
        (
            ONE + "pdo_links:\n- {from: 1.tpdo1, to: 1.rpdo1}\n- {from: 1.tpdo2, to: 1.rpdo1}",
            "line 4: pdo_links: 1.rpdo1 is linked twice",
        ),
        (
            ONE + "pdo_links: [{from: 1.tpdo513, to: 1.rpdo1}]",
            "line 2: from: tpdo513, there are 512 at most",
        ),
        ("[" * 20_000, "line 1: not YAML: lists or mappings nest too deep"),
        (ONE + "start: {order: [1, 1]}", "line 2: order: node 1 is there twice"),
        (ONE + "start: {order: [1, 2]}", "line 2: order: node 2 is not one of: 1"),
        (ONE + "start: {on: 1}", "line 2: start: YAML reads a key as True; put it into quotes"),
        (ONE + "start: 1", "line 2: start is written 'key: value', this is not"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(text: str, message: str) -> None:
    with pytest.raises(DefinitionError) as caught:
        parse_definition(text)
    assert str(caught.value).startswith(message)


def test_the_start_order_ends_with_those_that_it_leaves_out() -> None:
    assert parse_definition(K16).start_order == (32, 16)
    assert SystemDefinition(READ.nodes, start=StartEntry((32,))).start_order == (32, 16)


@pytest.mark.parametrize(
    ("name", "index"), [("tpdo1", 0x1800), ("tpdo4", 0x1803), ("rpdo2", 0x1401)]
)
def test_a_pdo_has_its_communication_parameter(name: str, index: int) -> None:
    assert PdoName(5, name).index == index


def test_ports_by_sdo_are_read() -> None:
    text = "nodes:\n- {id: 1, name: A, eds: a, sdo_ports: {x: {index: 0x2100, direction: out}}}"
    (node,) = parse_definition(text).nodes
    assert node.sdo_ports == {"x": SdoPortEntry(0x2100, PortDirection.OUT)}


def test_what_is_written_is_short_and_in_the_order_of_the_digest() -> None:
    assert write_definition(READ) == (
        "bus: {channel: vcan0, bitrate: 1000000}\n"
        "nodes:\n"
        "- id: 16\n"
        "  name: Palette0\n"
        "  eds: f-palette.eds\n"
        "  ports: {tpdo2: ai}\n"
        "- {id: 32, name: Motor0, eds: motor-core-unit.eds}\n"
        "sdo:\n"
        "- {node: 16, index: 0x6423, sub: 0, value: 1, size: 1}\n"
        "pdo_links:\n"
        "- {from: 16.tpdo2, to: 32.rpdo2}\n"
        "rt_connections:\n"
        "- {from: Palette0.ai, to: Logger0.in}\n"
        "start:\n"
        "  order: [32, 16]\n"
    )


@st.composite
def definitions(draw: st.DrawFn) -> SystemDefinition:
    ids = draw(st.lists(st.integers(1, 126), min_size=1, max_size=4, unique=True))
    some = st.none() | st.integers(0, 0xFFFF)
    pdos = st.builds(
        PdoEntry,
        st.none() | st.just((MappedObject(0x6401, 1, 16),)),
        st.none() | st.integers(0x181, 0x6DF),
        st.none() | st.integers(0, 255),
        some,
        some,
    )
    words = st.sampled_from(("ai", "x1", "no", "null"))
    sdo_ports = st.builds(
        SdoPortEntry,
        st.integers(0x1000, 0xFFFF),
        st.sampled_from(PortDirection),
        st.none() | st.sampled_from(tuple(PORT_TYPES)),
    )
    nodes = tuple(
        NodeEntry(
            node_id,
            f"N{node_id}",
            draw(st.text(st.characters(codec="utf-8", exclude_categories=("C", "Z")), min_size=1)),
            draw(st.sampled_from(Role)),
            draw(st.integers(1, 0xFFFF)),
            draw(st.dictionaries(st.just("tpdo1"), words)),
            draw(st.dictionaries(st.just("rpdo512"), pdos)),
            draw(st.integers(0, 0xFFFF)),
            draw(st.dictionaries(st.just("label"), sdo_ports)),
        )
        for node_id in ids
    )
    sizes = st.sampled_from((1, 2, 4, 8))
    values = st.integers(-128, 255)
    sdo = st.builds(
        SdoEntry, st.just(ids[0]), st.integers(0, 0xFFFF), st.integers(0, 255), values, sizes
    )
    link = PdoLink(PdoName(ids[0], "tpdo1"), PdoName(ids[-1], "rpdo3"))
    joint = RtConnection("A.b", "C.d", {"dataport.interface_type": "direct"})
    return SystemDefinition(
        nodes,
        BusEntry(draw(st.none() | words)),
        MasterEntry(127, 0, draw(st.floats(0.5, 1_000)), leave="stopped", sync_ms=5),
        tuple(draw(st.lists(sdo, max_size=2))),
        tuple(draw(st.lists(st.just(link), max_size=1))),
        tuple(draw(st.lists(st.just(joint), max_size=1))),
        StartEntry(tuple(draw(st.permutations(ids))), draw(st.booleans())),
    )


@settings(max_examples=40)
@given(definitions())
def test_what_is_written_is_read_again(definition: SystemDefinition) -> None:
    assert parse_definition(write_definition(definition)) == definition


@given(st.text(st.sampled_from("{}[]:,- \nabn01ids'\"&*!%\t#|")) | st.text())
def test_noise_is_refused_or_read(text: str) -> None:
    with suppress(DefinitionError):
        parse_definition(text)
