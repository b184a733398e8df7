"""An OutPort pushes to the InPort of another system, by bytes."""

from __future__ import annotations

import logging
import threading
from typing import Any

import pytest

from tests.host.rtc.chain import PERIOD_US
from tests.host.rtc.remote.engine import Pair, Reference, answer_put
from tickrig.host.rtc import PortStatus, ReturnCode, RtcRefused
from tickrig.host.rtc.commands.system_control import describe_component
from tickrig.host.rtc.commands.verbs import component_lines
from tickrig.host.rtc.engines.peer_ports import OutPortPushConnector, PeerEnd, PeerState, cdr
from tickrig.host.rtc.system.system import describe
from tickrig.wire.rtc_types.cdr import Endian
from tickrig.wire.rtc_types.rtc import Time, TimedLong

OK, LOST = PortStatus.PORT_OK, PortStatus.CONNECTION_LOST


def long(number: int) -> TimedLong:
    return TimedLong(Time(1, 2), number)


@pytest.mark.parametrize("endian", Endian)
@pytest.mark.parametrize("subscription", ["flush", "new", "periodic"])
def test_values_arrive_unchanged_and_in_order(
    pair: Pair, endian: Endian, subscription: str
) -> None:
    keys = {"subscription_type": subscription, "publisher.push_policy": "all"}
    pushed, _, _ = pair.push(keys, endian)
    pair.source.enter(1, -5, 2_147_483_647)
    pair.until(lambda: len(pair.numbers) == 3)
    assert pair.sink.received == [
        TimedLong(Time.from_us(1_000), 1),
        TimedLong(Time.from_us(2_000), -5),
        TimedLong(Time.from_us(3_000), 2_147_483_647),
    ]
    pair.until(lambda: pushed.sent == 3)
    assert (pushed.refused, pushed.buffer.dropped, pushed.state) == (0, 0, PeerState.CONNECTED)


@pytest.mark.parametrize(
    ("policy", "status", "left"),
    [
        ("overwrite", OK, [1, 4, 5]),
        ("do_nothing", PortStatus.BUFFER_FULL, [1, 2, 3]),
        ("block", PortStatus.BUFFER_TIMEOUT, [1, 2, 3]),
    ],
)
def test_a_peer_that_hangs_delays_nobody_and_the_policy_says_what_is_lost(
    pair: Pair, policy: str, status: PortStatus, left: list[int]
) -> None:
    keys = {"outport.buffer.length": "2", "outport.buffer.write.full_policy": policy}
    pushed, _, servant = pair.push(keys)
    servant.awake.clear()
    assert pair.out.write(long(1)) is OK
    pair.until(lambda: len(pushed.buffer) == 0)  # it is on its way
    assert [pair.out.write(long(number)) for number in (2, 3, 4, 5)] == [OK, OK, status, status]
    pair.near.manager.run_for(100 * PERIOD_US)
    assert pushed.buffer.dropped == 2
    servant.awake.set()
    pair.until(lambda: len(pair.numbers) == 3)
    assert pair.numbers == left
    assert pair.out.write(long(6)) is OK


def test_the_status_of_a_put_is_that_of_the_next_write(pair: Pair) -> None:
    keys = {"inport.buffer.length": "1", "inport.buffer.write.full_policy": "do_nothing"}
    pushed, _, _ = pair.push(keys)
    pair.far.step()
    pair.far.manager.deactivate("ConsoleOut0")
    pair.far.step()
    for number in (1, 2):
        assert pair.out.write(long(number)) is OK
    pair.until(lambda: (pushed.sent, pushed.refused) == (1, 1))
    assert pair.out.write(long(3)) is PortStatus.BUFFER_FULL
    pair.far.manager.activate("ConsoleOut0")
    pair.until(lambda: pair.numbers == [1])


def test_a_killed_peer_is_lost_in_a_line_and_found_again(
    pair: Pair, caplog: pytest.LogCaptureFixture
) -> None:
    pushed, put_into, servant = pair.push()
    assert pair.out.write(long(1)) is OK
    pair.until(lambda: (pair.numbers, pushed.sent) == ([1], 1))
    with caplog.at_level(logging.WARNING):
        servant.kill()
        pair.out.write(long(2))
        pair.until(lambda: pushed.state is PeerState.LOST)
        assert pair.out.write(long(3)) is LOST
        assert "    connected to far/ConsoleOut0.rtc:in (lost)" in lines_of(pair)
        pair.near.manager.run_for(20 * PERIOD_US)
        pair.far.serve(answer_put(put_into), servant.port)
        pair.until(lambda: pair.numbers == [1, 2, 3])
        pair.until(lambda: pushed.state is PeerState.CONNECTED)
        assert pair.out.write(long(4)) is OK
    lost, found = [record.getMessage() for record in caplog.records]
    assert lost.startswith("ConsoleIn0.out to far/ConsoleOut0.rtc:in: the peer does not answer: C")
    assert found.startswith("ConsoleIn0.out to far/ConsoleOut0.rtc:in: the peer answers again")


def test_a_call_that_takes_too_long_is_no_answer(pair: Pair) -> None:
    pushed, _, servant = pair.push(timeout_s=0.01)
    servant.awake.clear()
    pair.out.write(long(1))
    pair.until(lambda: pushed.state is PeerState.LOST)
    assert pair.out.write(long(2)) is LOST
    assert pushed.sent == 0


@pytest.mark.parametrize(("policy", "left"), [("overwrite", [2, 3]), ("do_nothing", [1, 2])])
def test_what_had_no_answer_is_put_again_unless_the_buffer_is_full(
    pair: Pair, policy: str, left: list[int]
) -> None:
    keys = {"outport.buffer.length": "2", "outport.buffer.write.full_policy": policy}
    pushed, _, servant = pair.push(keys)
    servant.awake.clear()
    pair.out.write(long(1))
    pair.until(lambda: len(pushed.buffer) == 0)
    pair.out.write(long(2))
    pair.out.write(long(3))
    servant.kill()
    pair.until(lambda: pushed.buffer.dropped == 1)
    put_into = pair.in_.connectors[0]
    pair.far.serve(answer_put(put_into), servant.port)  # type: ignore[arg-type]  # the one there is
    pair.until(lambda: pair.numbers[-2:] == left)  # the first may have come before the cut, too


def test_bytes_that_are_no_value_are_refused_and_logged_once(
    pair: Pair, caplog: pytest.LogCaptureFixture
) -> None:
    _, put_into, servant = pair.push()
    reference = pair.near.refer(servant)
    for _ in range(3):
        assert reference.put(b"\xff" * 13) is PortStatus.INVALID_ARGS
    pair.far.step()
    assert pair.numbers == []
    assert [record.getMessage() for record in caplog.records] == [
        "near/ConsoleIn0.rtc:out to ConsoleOut0.in: what came is no value:"
        " 13 bytes for IDL:RTC/TimedLong:1.0, 1 too many"
    ]
    assert put_into.joined


def test_a_value_that_does_not_fit_its_type_is_not_sent(pair: Pair) -> None:
    pushed, _, _ = pair.push()
    assert pair.out.write(long(2**31)) is PortStatus.INVALID_ARGS
    assert len(pushed.buffer) == 0


def test_after_the_end_of_a_connector_nothing_passes(pair: Pair) -> None:
    pushed, put_into, servant = pair.push()
    reference = pair.near.refer(servant)
    put_into.end()
    payload = cdr(TimedLong).encode(long(1))
    assert put(pair, reference, payload) is LOST
    pushed.end()
    assert pair.out.write(long(2)) is OK  # to nobody
    assert (pair.out.connectors, pair.in_.connectors, pair.numbers) == ((), (), [])


def test_components_are_reached_in_the_thread_of_their_manager_alone(pair: Pair) -> None:
    pair.push()
    threads = set[int]()
    pair.sink.show = lambda value: threads.add(threading.get_ident())
    pair.in_.on_connect.append(lambda profile: threads.add(threading.get_ident()))
    pair.source.enter(1, 2)
    pair.until(lambda: pair.numbers == [1, 2])
    assert threads == {threading.get_ident()}


def test_sixty_four_values_wait_for_a_peer_unless_it_is_said(pair: Pair) -> None:
    pushed, _, servant = pair.push()
    servant.awake.clear()
    for number in range(70):
        pair.out.write(long(number))
    assert len(pushed.buffer) == 64
    assert pushed.buffer.dropped in {5, 6}  # one may be on its way
    servant.awake.set()


@pytest.mark.parametrize(
    ("policy", "status", "left"),
    [
        ("overwrite", OK, [2, 3]),
        ("do_nothing", PortStatus.BUFFER_FULL, [1, 2]),
        ("block", PortStatus.BUFFER_TIMEOUT, [1, 2]),
    ],
)
def test_a_system_that_has_no_time_is_not_waited_for(
    pair: Pair, policy: str, status: PortStatus, left: list[int]
) -> None:
    keys = {"inport.buffer.length": "2", "inport.buffer.write.full_policy": policy}
    _, put_into, servant = pair.push(keys)
    pair.far.step()
    reference, payloads = pair.near.refer(servant), [cdr(TimedLong).encode(long(n)) for n in (1, 2)]
    assert [reference.put(payload) for payload in payloads] == [OK, OK]
    assert not pair.in_.is_new  # not in the middle of what the manager does
    assert reference.put(cdr(TimedLong).encode(long(3))) is status
    pair.far.calls.serve(0)
    assert len(put_into.buffer) == 2
    assert reference.put(cdr(TimedLong).encode(long(4))) is status
    pair.far.manager.run_for(PERIOD_US)
    assert pair.numbers == left


def test_a_system_that_has_ended_is_lost(pair: Pair) -> None:
    pushed, _, _ = pair.push()
    pair.out.write(long(1))
    pair.far.calls.close()
    pair.until(lambda: pushed.refused == 1)
    assert pair.out.write(long(2)) is LOST


def test_a_connector_is_shown_with_its_peer_and_not_saved(pair: Pair) -> None:
    pushed, put_into, _ = pair.push({"subscription_type": "new", "x": "kept"})
    assert pushed.profile.ports == ("ConsoleIn0.out", "far/ConsoleOut0.rtc:in")
    assert put_into.profile.ports == ("near/ConsoleIn0.rtc:out", "ConsoleOut0.in")
    assert (pushed.ports, pushed.joins_components) == ((pair.out,), False)
    assert pair.out.profile.connector_profiles == (pushed.profile,)
    assert pair.out.find_connector("9c1f") is pushed
    assert pushed.profile.properties == {
        "dataport.data_type": "IDL:RTC/TimedLong:1.0",
        "dataport.interface_type": "direct",
        "dataport.dataflow_type": "push",
        "dataport.subscription_type": "new",
        "dataport.x": "kept",
    }
    assert "    connected to far/ConsoleOut0.rtc:in" in lines_of(pair)
    assert describe(pair.near.manager).connections == ()


def test_a_peers_port_may_have_the_name_of_one_of_ours(pair: Pair) -> None:
    pair.near.manager.create("ConsoleOut")
    for end in (PeerEnd("ConsoleOut0.in", "a"), PeerEnd("ConsoleIn0.out", "b")):
        servant = pair.far.serve(lambda payload: b"\0")
        codec = cdr(TimedLong)
        OutPortPushConnector(
            pair.out, end, codec, pair.near.refer(servant), pair.near.thread
        ).begin()
    assert pair.near.manager.connectors == ()
    shown: Any = describe_component(pair.near.manager, pair.source)
    lines = list(component_lines(shown, long=False))
    assert [line.split()[-1] for line in lines if "connected to" in line] == [
        "ConsoleOut0.in",
        "ConsoleIn0.out",
    ]


def test_an_id_that_the_port_has_and_properties_that_cannot_be_are_refused(pair: Pair) -> None:
    pair.push()
    with pytest.raises(RtcRefused, match=r"ConsoleOut0\.in has a connector '9c1f' already") as why:
        pair.push()
    assert why.value.code is ReturnCode.PRECONDITION_NOT_MET
    pair.out.disconnect_all()
    pair.in_.disconnect_all()
    with pytest.raises(RtcRefused, match=r"dataport\.\w+\.buffer: buffer length 0"):
        pair.push({"buffer.length": "0"})


def test_deleting_a_component_ends_its_connectors(pair: Pair) -> None:
    pushed, _, _ = pair.push({"subscription_type": "new"})
    assert list(pair.near.known) == ["ConsoleIn0"]
    pair.near.manager.delete("ConsoleIn0")
    assert (pushed.joined, pair.near.known) == (False, {})
    pair.near.step()


def put(pair: Pair, reference: Reference, payload: bytes) -> PortStatus:
    """Put in the thread of the peer, while the far system runs."""
    answers: list[PortStatus] = []
    pair.near.thread.submit(lambda: answers.append(reference.put(payload)))
    pair.until(lambda: answers)
    return answers[0]


def lines_of(pair: Pair) -> list[str]:
    """Return what `tickrig rtc cat -l` shows of the component that pushes."""
    shown: Any = describe_component(pair.near.manager, pair.source)
    return list(component_lines(shown, long=True))
