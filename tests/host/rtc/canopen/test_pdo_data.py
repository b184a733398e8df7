"""Data between PDOs and ports."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

from tests.emulators.can.can_bench import frames
from tests.host.rtc.canopen.bench import EDS, PALETTE_AND_MOTOR, Bench
from tests.host.rtc.canopen.components import add_knob, add_logger
from tickrig.host.rtc import ReturnCode
from tickrig.host.rtc.canopen.events import ServerEventType
from tickrig.host.rtc.ports.port import ConnectorProfile
from tickrig.wire.rtc_types.rtc import Time, TimedOctet, TimedShortSeq


def running(more: str = "") -> Bench:
    bench = Bench(PALETTE_AND_MOTOR + more)
    bench.boot()
    bench.activate()
    return bench


def test_a_frame_is_written_to_the_port_with_the_time_of_its_reception() -> None:
    bench = running()
    logger = add_logger(bench.server.manager, TimedOctet)
    bench.server.manager.connect("Palette0.tpdo1", "Logger0.in")
    bench.run_ms(5)
    bench.devices[16].physical["di1"].write(1)
    bench.run_ms(20)
    (at,) = [at for at, heard in bench.log.heard if str(heard) == "190#01"]
    ((_, value),) = logger.heard
    assert (value.data, value.tm.us) == (1, at)


def test_a_value_at_an_in_port_is_one_frame() -> None:
    bench = running()
    knob = add_knob(bench.server.manager, TimedOctet)
    bench.server.manager.connect("Knob0.out", "Palette0.rpdo1")
    knob.out.write(TimedOctet(Time(), 0x55))
    bench.run_ms(10)
    assert bench.log.text.count("210#55") == 1
    assert bench.devices[16].read("do") == 0x55


def test_a_sequence_of_the_wrong_length_is_refused_and_nothing_is_sent() -> None:
    bench = running()
    knob = add_knob(bench.server.manager, TimedShortSeq)
    bench.server.manager.connect("Knob0.out", "Motor0.rpdo2")
    knob.out.write(TimedShortSeq(Time(), (1, 2)))
    bench.run_ms(20)
    assert "320#" not in bench.log.text
    assert len(bench.events(ServerEventType.VALUE_REFUSED)) == 1
    put = bench.server.put
    assert put("Motor0.rpdo2", TimedShortSeq(Time(), (1, 2))) is ReturnCode.BAD_PARAMETER
    assert put("Motor0.rpdo2", TimedShortSeq(Time(), (1, 2, 3, 4))) is ReturnCode.RTC_OK
    assert put("Motor0.x", TimedShortSeq()) is ReturnCode.BAD_PARAMETER
    bench.run_ms(20)
    assert "320#0100020003000400" in bench.log.text


def test_a_proxy_that_is_not_active_passes_nothing() -> None:
    bench = Bench()
    bench.boot()
    knob = add_knob(bench.server.manager, TimedOctet)
    logger = add_logger(bench.server.manager, TimedOctet)
    bench.server.manager.connect("Knob0.out", "Palette0.rpdo1")
    bench.server.manager.connect("Palette0.tpdo1", "Logger0.in")
    bench.run_ms(20)
    knob.out.write(TimedOctet(Time(), 0x55))
    bench.server.tick(bench.now_us, ())
    bench.other.send(frames("190#01"))
    bench.run_ms(20)
    code = bench.server.put("Palette0.rpdo1", TimedOctet())
    assert code is ReturnCode.PRECONDITION_NOT_MET
    bench.activate(16)
    assert "210#" not in bench.log.text
    assert all(value.data == 0 for _, value in logger.heard)


def test_a_pdo_that_is_too_short_is_dropped() -> None:
    bench = running()
    bench.other.send(frames("290#00"))
    bench.run_ms(5)
    assert bench.events(ServerEventType.PDO_TOO_SHORT) == ["PdoTooShort 16 tpdo2: 1 of 8 bytes"]


def test_ports_that_do_not_fit_are_not_connected() -> None:
    bench = Bench(PALETTE_AND_MOTOR + "rt_connections: [{from: Palette0.ai, to: Motor0.rpdo2}]\n")
    bench.boot()
    bench.run_ms(50)
    assert bench.server.connections.wanted  # there is no such port
    text = "rt_connections: [{from: Palette0.tpdo1, to: Motor0.rpdo2}]\n"
    bench = Bench(PALETTE_AND_MOTOR + text)
    bench.boot()
    bench.run_ms(50)
    (event,) = bench.events(ServerEventType.CONNECTION_REFUSED)
    assert "carries IDL:RTC/TimedOctet:1.0" in event


def test_a_pdo_with_an_object_that_no_port_has_gets_no_port(tmp_path: Path) -> None:
    head, digital = (EDS / "f-palette.eds").read_text("utf-8").split("[6000sub1]")
    changed = digital.replace("DataType=0x0005", "DataType=0x0009", 1)
    (tmp_path / "f-palette.eds").write_text(f"{head}[6000sub1]{changed}", "utf-8")
    text = "nodes: [{id: 16, name: Palette0, eds: f-palette.eds, role: device}]\n"
    bench = Bench(text, {16: "f-palette"}, tmp_path)
    bench.boot()
    assert bench.events(ServerEventType.PORT_REFUSED) == [
        "PortRefused 16 tpdo1: no port has the type of 6000h:01"
    ]
    proxy = bench.proxy(16)
    assert proxy is not None
    assert "tpdo1" not in proxy.ports


def test_the_server_sends_sync_and_synchronous_pdos_come() -> None:
    bench = Bench(
        "master: {sync_ms: 20}\n"
        "nodes: [{id: 16, name: Palette0, eds: f-palette.eds, role: device,"
        " pdos: {tpdo1: {type: 1}}}]\n",
        {16: "f-palette"},
    )
    bench.boot()
    bench.activate(16)
    bench.log.heard.clear()
    bench.run_ms(100)
    heard = [(at, str(frame)) for at, frame in bench.log.heard]
    assert [text for _, text in heard if text in ("080#", "190#00")] == ["080#", "190#00"] * 5
    syncs = [at for at, text in heard if text == "080#"]
    assert [later - before for before, later in pairwise(syncs)] == [20_000] * 4


def test_values_at_several_in_ports_are_sent_in_the_order_of_the_nodes() -> None:
    bench = running()
    server = bench.server
    shorts = add_knob(server.manager, TimedShortSeq, "Knob1")
    octet = add_knob(server.manager, TimedOctet)
    server.manager.connect("Knob1.out", "Motor0.rpdo2")
    server.manager.connect("Knob0.out", "Palette0.rpdo1", {"dataport.subscription_type": "new"})
    bench.run_ms(5)
    for number in (1, 2):
        shorts.out.write(TimedShortSeq(Time(), (number, 0, 0, 0)))
        octet.out.write(TimedOctet(Time(), number))
        sent = [str(frame) for frame in server.tick(bench.now_us, ()) if frame.can_id < 0x700]
        data = f"0{number}"
        assert sent == [f"210#{data}", f"320#{data}00000000000000"]
    server.manager.disconnect("Knob0.out", "Palette0.rpdo1")
    octet.out.write(TimedOctet(Time(), 3))
    shorts.out.write(TimedShortSeq(Time(), (3, 0, 0, 0)))
    sent = [str(frame) for frame in server.tick(bench.now_us, ())]
    assert sent == ["320#0300000000000000"]


def test_a_value_that_is_written_while_its_port_is_being_connected_is_sent() -> None:
    bench = running()
    knob = add_knob(bench.server.manager, TimedOctet)

    def write(_: ConnectorProfile) -> None:
        knob.out.write(TimedOctet(Time(), 0x2A))

    knob.out.on_connect.append(write)
    bench.server.manager.connect("Knob0.out", "Palette0.rpdo1")
    assert [str(frame) for frame in bench.server.tick(bench.now_us, ())] == ["210#2A"]


def test_a_value_that_waits_in_a_buffer_is_sent_once_there_are_enough() -> None:
    bench = running()
    knob = add_knob(bench.server.manager, TimedOctet)
    properties = {"buffer.read.policy": "skip", "buffer.read.skip_count": "1"}
    bench.server.manager.connect(
        "Knob0.out", "Palette0.rpdo1", {f"dataport.inport.{k}": v for k, v in properties.items()}
    )
    sent = list[str]()
    for number in range(1, 5):
        knob.out.write(TimedOctet(Time(), number))
        sent += map(str, bench.server.tick(bench.now_us, ()))
    assert sent == ["210#02", "210#04"]
