"""Ports that SDO carries, and those of bits, wide characters and a fifth PDO (K5)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import canopen
import pytest

from tests.device.canopen.device_rtc.test_ports import Wide
from tests.emulators.can.can_bench import Log
from tests.host.rtc.canopen.bench import Bench
from tests.host.rtc.canopen.components import add_knob, add_logger
from tickrig.device.canopen.device_rtc import make_device_rtc
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.outside.sim_network import SimNetwork
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.rtc import LifeCycleState, ReturnCode
from tickrig.host.rtc.canopen.connections import check_lengths
from tickrig.host.rtc.canopen.definition import PdoLink, PdoName, ServerRefused
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.host.rtc.canopen.events import ServerEventType
from tickrig.host.rtc.canopen.offline import check_offline
from tickrig.host.rtc.canopen.pdo_layout import PdoLayout, lay_out
from tickrig.host.rtc.canopen.proxy import ProxyRtc
from tickrig.host.rtc.canopen.serve import read_files, serve
from tickrig.host.rtc.canopen.server import RtcCanopenServer
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.canopen.pdo import MappedObject
from tickrig.wire.rtc_canopen import object_table
from tickrig.wire.rtc_types.rtc import (
    Time,
    TimedBooleanSeq,
    TimedDoubleSeq,
    TimedShort,
    TimedString,
    TimedWCharSeq,
    TimedWString,
)

DEFINITION = """
nodes:
- id: 16
  name: Wide0
  eds: wide.eds
  ports: {rpdo1: flags, rpdo2: word, tpdo1: flags_out, tpdo2: word_out, tpdo6: sixth}
  sdo_ports:
    label: {index: 0x2102, direction: in}
    path: {index: 0x2103, direction: in, type: Double}
    label_out: {index: 0x2106, direction: out}
    path_out: {index: 0x2107, direction: out}
    slow: {index: 0x2108, direction: out}
  pdos: {tpdo6: {cob_id: 0x2B5}}
"""


class WideBench:
    """The component of the device tests on a bus, and a server."""

    def __init__(self, folder: Path, text: str = DEFINITION) -> None:
        (folder / "wide.eds").write_text(write_eds(object_table(Wide.profile())), "utf-8")
        wire = CanWire()
        self.log = Log(wire)
        self.node = Node("16", make_device_rtc(Wide, 16), wire)
        self.rig = Rig(Station(self.node, self.node.port))
        definition = parse_definition(text)
        self.server = RtcCanopenServer(definition, read_files(definition, folder))
        self.link = CanHost(self.rig, wire.end())
        self.run_ms(300)

    def run_ms(self, duration_ms: int) -> None:
        serve(self.server, self.link, self.rig.now_us + 1_000 * duration_ms)

    def activate(self) -> None:
        self.server.manager.activate("Wide0")
        self.run_ms(300)

    @property
    def proxy(self) -> ProxyRtc:
        proxy = self.server.nodes[16].proxy
        assert proxy is not None, self.server.log.events
        return proxy

    def count(self, begin: str) -> int:
        return sum(str(heard).startswith(begin) for _, heard in self.log.heard)

    def events(self, kind: ServerEventType) -> list[str]:
        return [event.text for event in self.server.log.events if event.kind is kind]


@pytest.fixture
def bench(tmp_path: Path) -> WideBench:
    return WideBench(tmp_path)


READ_LABEL = "610#4006210000000000"
WRITE_LABEL = "610#21022100"


def test_ports_say_in_their_profile_what_carries_them(bench: WideBench) -> None:
    transports = {
        port.name: port.profile.properties.get("transport") for port in bench.proxy.ports.values()
    }
    by_sdo = {name for name, transport in transports.items() if transport == "sdo"}
    assert by_sdo == {"label", "path", "label_out", "path_out", "slow"}
    assert {"flags", "word", "flags_out", "word_out", "tpdo5", "sixth"} <= transports.keys()


def test_a_text_goes_there_and_back(bench: WideBench) -> None:
    manager = bench.server.manager
    knob, logger = add_knob(manager, TimedString), add_logger(manager, TimedWString)
    manager.connect("Knob0.out", "Wide0.label")
    manager.connect("Wide0.label_out", "Logger0.in")
    bench.activate()
    knob.out.write(TimedString(Time(), "grüß die Katze"))
    bench.run_ms(100)
    assert bench.node.read("in.label") == "grüß die Katze"
    at_us, value = logger.heard[-1]
    assert value.data == "grüß die Katze"
    assert at_us - 20_000 < value.tm.us <= at_us


def test_a_sequence_that_is_wider_than_a_pdo_goes_there_and_back(bench: WideBench) -> None:
    manager = bench.server.manager
    knob, logger = add_knob(manager, TimedDoubleSeq), add_logger(manager, TimedDoubleSeq)
    manager.connect("Knob0.out", "Wide0.path")
    manager.connect("Wide0.path_out", "Logger0.in")
    bench.activate()
    knob.out.write(TimedDoubleSeq(Time(), (0.1, -2.5)))
    bench.run_ms(100)
    assert logger.heard[-1][1].data == (0.1, -2.5)


def test_bits_and_wide_characters_are_ports_of_pdos(bench: WideBench) -> None:
    manager = bench.server.manager
    bits = add_logger(manager, TimedBooleanSeq, "Bits0")
    word = add_logger(manager, TimedWCharSeq, "Word0")
    manager.connect("Wide0.flags_out", "Bits0.in")
    manager.connect("Wide0.word_out", "Word0.in")
    bench.activate()
    flags = (True, False, True, *[False] * 6, True)
    assert bench.server.put("Wide0.flags", TimedBooleanSeq(Time(), flags)) is ReturnCode.RTC_OK
    put = bench.server.put("Wide0.word", TimedWCharSeq(Time(), ("猫", "A", "ß")))
    assert put is ReturnCode.RTC_OK
    bench.run_ms(50)
    assert bits.heard[-1][1].data == flags
    assert word.heard[-1][1].data == ("猫", "A", "ß")
    assert bench.count("210#0502") == 1


def test_a_fifth_pdo_and_one_whose_cob_id_the_definition_names_are_ports(
    bench: WideBench,
) -> None:
    manager = bench.server.manager
    fifth, sixth = add_logger(manager, TimedShort, "Five0"), add_logger(manager, TimedShort, "Six0")
    manager.connect("Wide0.tpdo5", "Five0.in")
    manager.connect("Wide0.sixth", "Six0.in")
    bench.activate()
    bench.server.put("Wide0.flags", TimedBooleanSeq(Time(), (True,) * 10))
    bench.run_ms(50)
    assert [value.data for _, value in fifth.heard] == [0, 1]
    assert [value.data for _, value in sixth.heard] == [0]
    assert bench.count("2B5#") == 1


def test_an_object_is_read_once_a_period_and_only_if_somebody_listens(bench: WideBench) -> None:
    bench.activate()
    bench.run_ms(200)
    assert bench.count(READ_LABEL) == 0
    add_logger(bench.server.manager, TimedWString)
    bench.server.manager.connect("Wide0.label_out", "Logger0.in")
    bench.run_ms(1_000)  # 100 Hz
    assert 95 <= bench.count(READ_LABEL) <= 101


def test_of_several_values_in_a_period_the_newest_is_written(bench: WideBench) -> None:
    knob = add_knob(bench.server.manager, TimedString)
    bench.server.manager.connect("Knob0.out", "Wide0.label")
    bench.activate()
    for text in ("a", "b", "c"):
        knob.out.write(TimedString(Time(), text * 6))
    bench.run_ms(100)
    assert bench.node.read("in.label") == "cccccc"
    assert bench.count(WRITE_LABEL) == 1


def test_nothing_is_transferred_while_the_proxy_is_not_active(bench: WideBench) -> None:
    manager = bench.server.manager
    knob = add_knob(manager, TimedString)
    add_logger(manager, TimedWString)
    manager.connect("Knob0.out", "Wide0.label")
    manager.connect("Wide0.label_out", "Logger0.in")
    value = TimedString(Time(), "early")
    knob.out.write(value)
    assert bench.server.put("Wide0.label", value) is ReturnCode.PRECONDITION_NOT_MET
    bench.run_ms(200)
    assert bench.count(READ_LABEL) + bench.count(WRITE_LABEL) == 0
    bench.activate()
    manager.deactivate("Wide0")
    bench.run_ms(300)
    before = bench.count(READ_LABEL)
    bench.run_ms(300)
    assert (bench.count(READ_LABEL), bench.proxy.state) == (before, LifeCycleState.INACTIVE)
    assert (bench.node.read("in.label"), before > 10) == ("", True)


@pytest.mark.parametrize("text", ["✓", "x" * 256])
def test_a_text_that_the_object_cannot_hold_is_refused_and_not_sent(
    bench: WideBench, text: str
) -> None:
    knob = add_knob(bench.server.manager, TimedString)
    bench.server.manager.connect("Knob0.out", "Wide0.label")
    bench.activate()
    knob.out.write(TimedString(Time(), text))
    bench.run_ms(100)
    assert len(bench.events(ServerEventType.VALUE_REFUSED)) == 1
    assert bench.count(WRITE_LABEL) == 0
    assert bench.server.put("Wide0.label", TimedString(Time(), text)) is ReturnCode.BAD_PARAMETER


def test_a_port_that_the_eds_cannot_give_is_told_of_on_paper_and_on_the_bus(
    tmp_path: Path,
) -> None:
    text = DEFINITION.replace("index: 0x2108", "index: 0x2999").replace("Double", "String")
    bench = WideBench(tmp_path, text)
    wanted = [
        "path: 2103h is REAL64 in the EDS, not String",
        "slow: the EDS has no object 2999h",
    ]
    assert bench.events(ServerEventType.PORT_REFUSED) == wanted
    definition = parse_definition(text)
    paper = check_offline(RtcCanopenServer(definition, read_files(definition, tmp_path)))
    assert paper == tuple(f"nodes: Wide0.{line}" for line in wanted)


def test_an_abort_is_told_once_and_holds_up_no_other_port(tmp_path: Path) -> None:
    """2107h:01 is taken for a port that writes; the device lets it be read alone."""
    text = DEFINITION.replace("index: 0x2107, direction: out", "index: 0x2107, direction: in")
    bench = WideBench(tmp_path, text)
    manager = bench.server.manager
    logger = add_logger(manager, TimedWString)
    manager.connect("Wide0.label_out", "Logger0.in")
    bench.activate()
    for _ in range(3):
        bench.server.put("Wide0.path_out", TimedDoubleSeq(Time(), (1.0, 2.0)))
        before = len(logger.heard)
        bench.run_ms(50)
        assert len(logger.heard) > before
    (told,) = bench.events(ServerEventType.SDO_ABORTED)
    assert told.startswith("Wide0.path_out: ")


def test_a_pdo_without_a_cob_id_stays_off_whatever_else_is_written(tmp_path: Path) -> None:
    bench = WideBench(tmp_path, DEFINITION.replace("cob_id: 0x2B5", "event_ms: 50"))
    assert "tpdo5" in bench.proxy.ports
    assert "sixth" not in bench.proxy.ports
    dictionary = bench.node.slave.dictionary
    assert (dictionary[0x1805, 1].number, dictionary[0x1805, 5].number) == (0x8000_0000, 50)


def test_booleans_of_a_tpdo_are_linked_with_those_and_the_dummies_of_an_rpdo() -> None:
    def layout(index: int, *entries: int) -> PdoLayout:
        mapping = tuple(map(MappedObject.parse, entries))
        data_types = {(one.index, one.sub): DataType.BOOLEAN for one in mapping if one.index > 32}
        return lay_out(index, 0x181, mapping, data_types)

    link = PdoLink(PdoName(1, "tpdo1"), PdoName(2, "rpdo1"))
    three = layout(0x1800, 0x2100_0101, 0x2100_0201, 0x2100_0301)
    filled = layout(0x1400, 0x2100_0101, 0x2100_0201, 0x2100_0301, *[0x0001_0001] * 5)
    nine = layout(0x1400, *[0x2100_0001 | sub << 8 for sub in range(1, 10)])
    assert (three.bits, filled.bits, filled.unknown) == (3, 8, ())
    check_lengths(link, three, filled)
    with pytest.raises(ServerRefused, match=r"1\.tpdo1 has 3 bits, 2\.rpdo1 has 9"):
        check_lengths(link, three, nine)


def test_a_text_of_a_device_off_the_shelf_is_a_port() -> None:
    port = "sdo_ports: {model: {index: 0x1008, direction: out}}"
    node = f"{{id: 16, name: Palette0, eds: f-palette.eds, role: device, {port}}}"
    bench = Bench(f"nodes: [{node}]", {16: "f-palette"})
    bench.boot()
    logger = add_logger(bench.server.manager, TimedString)
    bench.server.manager.connect("Palette0.model", "Logger0.in")
    bench.activate()
    assert logger.heard[-1][1].data == "f-palette"


def test_a_node_of_the_canopen_library_has_texts_as_ports(tmp_path: Path) -> None:
    file = tmp_path / "wide.eds"
    file.write_text(write_eds(object_table(Wide.profile())), "utf-8")
    wire, rig = CanWire(), Rig()
    local: Any = SimNetwork(rig, wire.end()).add_node(canopen.LocalNode(16, str(file)))
    text = DEFINITION.replace("name: Wide0", "name: Wide0\n  role: device").partition("  pdos")[0]
    definition = parse_definition(text)
    server, link = (
        RtcCanopenServer(definition, read_files(definition, tmp_path)),
        CanHost(rig, wire.end()),
    )
    knob = add_knob(server.manager, TimedString)
    logger = add_logger(server.manager, TimedWString)
    serve(server, link, 2_000_000)
    server.manager.connect("Knob0.out", "Wide0.label")
    server.manager.connect("Wide0.label_out", "Logger0.in")
    server.manager.activate("Wide0")
    serve(server, link, 2_500_000)
    local.sdo["label_out"].raw = "die Katze auf dem Dach"
    knob.out.write(TimedString(Time(), "komm herunter"))
    serve(server, link, 3_000_000)
    assert logger.heard[-1][1].data == "die Katze auf dem Dach"
    assert local.sdo["label"].raw == "komm herunter"
