"""The limits of a node: each is enforced, counted, and told in a line."""

from __future__ import annotations

import threading
from collections.abc import Iterator

import pytest

from tests.host.rtc.remote.engine import DEADLINE_S
from tickrig.emulators.tkernel.node_manager import NodeLimits, NodeManager
from tickrig.host.rtc import InPort, PortStatus, ReturnCode, RtcRefused
from tickrig.host.rtc.commands.system_control import Probes
from tickrig.host.rtc.component import ExecutionContext
from tickrig.host.rtc.components import EXAMPLES, ConsoleIn, ConsoleOut, SeqOut
from tickrig.host.rtc.engines.peer_ports import InPortPushConnector, PeerEnd, cdr
from tickrig.host.rtc.ports.connect import connect
from tickrig.host.rtc.system.call_queue import CallQueue
from tickrig.wire.rtc_types.cdr import encode
from tickrig.wire.rtc_types.rtc import TimedLong, TimedOctetSeq, TimedString


def node(**limits: int) -> NodeManager:
    manager = NodeManager(NodeLimits(**limits))
    for kind in EXAMPLES:
        manager.register(kind)
    return manager


@pytest.fixture
def told(caplog: pytest.LogCaptureFixture) -> Iterator[list[str]]:
    lines: list[str] = []
    yield lines
    assert [record.getMessage() for record in caplog.get_records("call")] == lines


PREFIX = "refused, a limit of the node: "


def test_components_run_at_100_hz_in_the_context_tkernel() -> None:
    manager = node()
    component = manager.create("ConsoleIn")
    assert manager.path("ConsoleIn0") == "tkernel/ConsoleIn0.rtc"
    assert component.contexts[0].period_us == 10_000


def test_a_period_is_a_multiple_of_the_cyclic_handler(told: list[str]) -> None:
    manager = node()
    for rate_hz in (100, 50, 1e6 / 30_000, 1):
        manager.create("ConsoleIn", rate_hz=rate_hz)
    with pytest.raises(RtcRefused, match="its period of 1 ms is no multiple") as caught:
        manager.create("ConsoleOut", rate_hz=1_000)
    assert caught.value.code is ReturnCode.BAD_PARAMETER
    assert (len(manager.components), manager.refused["periods"]) == (4, 1)
    why = "ConsoleOut0: its period of 1 ms is no multiple of the cyclic handler's 10 ms"
    told.append(PREFIX + why)


def test_so_is_one_that_is_set_later(told: list[str]) -> None:
    manager = node()
    context = manager.create("ConsoleIn").contexts[0]
    assert context.set_rate(150) is ReturnCode.BAD_PARAMETER
    assert context.set_rate(30) is ReturnCode.BAD_PARAMETER
    assert context.rate_hz == 100
    assert context.set_rate(20) is ReturnCode.RTC_OK
    assert manager.refused["periods"] == 2
    why = "its period of 6.667 ms is no multiple of the cyclic handler's 10 ms"
    told.append(f"{PREFIX}ConsoleIn0: {why}")


def test_so_is_that_of_a_shared_context(told: list[str]) -> None:
    with pytest.raises(RtcRefused, match="its period of 5 ms"):
        node().create("ConsoleIn", context=ExecutionContext(200))
    told.append(
        f"{PREFIX}ConsoleIn0: its period of 5 ms is no multiple of the cyclic handler's 10 ms"
    )


def test_there_are_no_more_connectors_than_it_has(told: list[str]) -> None:
    manager = node(connectors=2)
    for name in ("ConsoleIn", "ConsoleOut", "ConsoleOut", "ConsoleOut"):
        manager.create(name)
    manager.connect("ConsoleIn0.out", "ConsoleOut0.in")
    manager.connect("ConsoleIn0.out", "ConsoleOut1.in")
    with pytest.raises(RtcRefused, match="2 connectors are all that this node has") as caught:
        manager.connect("ConsoleIn0.out", "ConsoleOut2.in")
    assert caught.value.code is ReturnCode.OUT_OF_RESOURCES
    assert manager.port("ConsoleOut2.in").connectors == ()
    manager.disconnect("ConsoleIn0.out", "ConsoleOut0.in")
    manager.connect("ConsoleIn0.out", "ConsoleOut2.in")
    assert manager.refused["connectors"] == 1
    way = "ConsoleIn0.out to ConsoleOut2.in"
    told.append(f"{PREFIX}{way}: 2 connectors are all that this node has")


def test_connectors_of_peers_count(told: list[str]) -> None:
    manager, calls = node(connectors=1), CallQueue()
    sink = manager.add(ConsoleOut("ConsoleOut0"))

    def begin(number: int) -> InPortPushConnector[TimedLong, bytes]:
        end = PeerEnd(f"pc/ConsoleIn{number}.rtc:out", f"id{number}")
        connector = InPortPushConnector(sink.in_, end, cdr(TimedLong), calls)
        connector.begin()
        return connector

    first = begin(0)
    with pytest.raises(RtcRefused, match="1 connectors are all"):
        begin(1)
    assert sink.in_.connectors == (first,)
    calls.close()
    way = "pc/ConsoleIn1.rtc:out to ConsoleOut0.in"
    told.append(f"{PREFIX}{way}: 1 connectors are all that this node has")


def test_data_passes_as_cdr_and_in_no_newer_way(told: list[str]) -> None:
    manager = node()
    manager.create("ConsoleIn")
    manager.create("ConsoleOut")
    ends = ("ConsoleIn0.out", "ConsoleOut0.in")
    with pytest.raises(RtcRefused, match=r"direct is not of OpenRTM 1\.0") as caught:
        manager.connect(*ends, {"dataport.interface_type": "direct"})
    assert caught.value.code is ReturnCode.UNSUPPORTED
    with pytest.raises(RtcRefused, match=r"buffer.read.policy is not of OpenRTM 1.0"):
        manager.connect(*ends, {"dataport.buffer.read.policy": "last"})
    profile = manager.connect(*ends)
    assert profile.properties["dataport.interface_type"] == "corba_cdr"
    assert manager.refused["interfaces"] == 2
    way = " to ".join(ends)
    told.append(
        f"{PREFIX}{way}: dataport.interface_type direct is not of OpenRTM 1.0: corba_cdr is"
    )


def test_a_message_has_no_more_octets_than_it_takes(told: list[str]) -> None:
    manager = node(message_octets=40)
    manager.add(SeqOut("SeqOut0"))
    port = manager.port("SeqOut0.OctetSeq")
    probe: InPort[TimedOctetSeq] = InPort("in", TimedOctetSeq)
    connect(port, probe)
    fits, too_long = TimedOctetSeq(data=bytes(28)), TimedOctetSeq(data=bytes(29))
    assert len(encode(too_long)) == 41
    assert port.write(fits) is PortStatus.PORT_OK  # type: ignore[attr-defined]
    for _ in range(3):
        assert port.write(too_long) is PortStatus.PORT_ERROR  # type: ignore[attr-defined]
    assert (probe.read(), probe.is_new) == (fits, False)
    assert manager.refused["messages"] == 3
    told.append(f"{PREFIX}SeqOut0.OctetSeq: 41 octets are more than 40 a message")


def test_nor_has_one_that_comes_from_a_peer(told: list[str]) -> None:
    manager, calls = node(message_octets=16), CallQueue()
    component = manager.create("ConsoleOut")
    port = component.add_port(InPort("text", TimedString))
    port.guard = manager
    connector = InPortPushConnector(port, PeerEnd("pc/X0.rtc:out", "id"), cdr(TimedString), calls)
    connector.begin()
    assert connector.put(encode(TimedString(data="abc"))) is PortStatus.PORT_OK
    assert connector.put(encode(TimedString(data="abcd"))) is PortStatus.INVALID_ARGS
    calls.close()
    told.append(f"{PREFIX}ConsoleOut0.text: 17 octets are more than 16 a message")


def test_what_is_no_value_is_refused_as_such() -> None:
    manager = node()
    manager.create("ConsoleIn")
    manager.create("ConsoleOut")
    manager.connect("ConsoleIn0.out", "ConsoleOut0.in")
    port = manager.port("ConsoleIn0.out")
    assert port.write(TimedLong(data=1 << 40)) is PortStatus.INVALID_ARGS  # type: ignore[attr-defined]


def test_observers_are_on_no_board() -> None:
    manager = node(connectors=1)
    source, sink = manager.add(ConsoleIn("ConsoleIn0")), manager.add(ConsoleOut("ConsoleOut0"))
    manager.connect("ConsoleIn0.out", "ConsoleOut0.in")
    probes = Probes(manager)
    probes.watch("ConsoleIn0.out", 0)
    probes.inject("ConsoleOut0.in", 7)
    manager.activate("ConsoleIn0", "ConsoleOut0")
    source.enter(5)
    manager.run_for(50_000)
    assert sorted(value.data for value in sink.received) == [5, 7]
    assert len(probes.watch("ConsoleIn0.out", 0)[0]) == 1


def test_requests_of_many_peers_are_served_one_after_the_other() -> None:
    calls, most, running = CallQueue(), [0], [0]

    def request() -> None:
        running[0] += 1
        most[0] = max(most[0], running[0])
        threading.Event().wait(0.001)
        running[0] -= 1

    threads = [threading.Thread(target=calls.call, args=(request, 10_000_000)) for _ in range(8)]
    for thread in threads:
        thread.start()
    while any(thread.is_alive() for thread in threads):
        calls.serve(1_000)
    assert most == [1]
    calls.close()
    for thread in threads:
        thread.join(DEADLINE_S)


@pytest.mark.parametrize(
    ("limits", "told_text"),
    [
        ({"connectors": 0}, "connectors 0 is not in 1..1000"),
        ({"message_octets": 8}, "message_octets 8 is not in 16..1048576"),
        ({"tick_us": 1}, "tick_us 1 is not in 1000..1000000"),
        ({"boot_us": -1}, "boot_us -1 is not in 0..600000000"),
    ],
)
def test_limits_that_cannot_be_are_refused(limits: dict[str, int], told_text: str) -> None:
    with pytest.raises(ValueError, match=told_text):
        NodeLimits(**limits)
