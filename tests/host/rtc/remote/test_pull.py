"""An InPort pulls from the OutPort of another system, by bytes."""

from __future__ import annotations

import logging

import pytest

from tests.host.rtc.chain import PERIOD_US
from tests.host.rtc.remote.engine import Pair, answer_get
from tests.host.rtc.remote.test_push import long
from tickrig.host.rtc import PortStatus
from tickrig.host.rtc.engines.peer_ports import PeerState

OK = PortStatus.PORT_OK


def test_values_are_fetched_as_they_are_read(pair: Pair) -> None:
    pair.pull()
    pair.source.enter(1, 2, 3, 4)
    pair.until(lambda: pair.numbers == [1, 2, 3, 4])


def test_nothing_is_fetched_before_somebody_reads(pair: Pair) -> None:
    held, _, _ = pair.pull()
    for number in (1, 2):
        pair.out.write(long(number))
    assert len(held.buffer) == 2
    assert not pair.in_.is_new
    pair.until(lambda: len(held.buffer) < 2)


def test_a_reader_that_does_not_look_first_gets_values_too(pair: Pair) -> None:
    pair.pull({"buffer.read.empty_policy": "do_nothing"})
    pair.out.write(long(7))
    seen: list[int] = []

    def read() -> bool:
        value = pair.in_.read()
        seen.extend([] if value is None else [value.data])
        return bool(seen or pair.numbers)

    pair.until(read)
    assert [*seen, *pair.numbers] == [7]


def test_an_empty_port_is_no_lost_peer(pair: Pair) -> None:
    keys = {"buffer.read.empty_policy": "do_nothing"}
    held, pulled, servant = pair.pull(keys)
    reference = pair.far.refer(servant)
    answers: list[object] = []
    pair.far.thread.submit(lambda: answers.append(reference.get()))
    pair.until(lambda: answers)
    assert answers == [None]
    assert (pulled.state, held.get()) == (PeerState.CONNECTED, (PortStatus.BUFFER_EMPTY, None))


def test_with_readback_an_empty_port_gives_its_last_value_again(pair: Pair) -> None:
    held, _, _ = pair.pull()
    assert held.get() == (PortStatus.BUFFER_EMPTY, None)
    pair.out.write(long(1))
    assert held.get()[0] is OK
    assert held.get()[0] is OK


def test_a_peer_that_hangs_delays_nobody(pair: Pair) -> None:
    _, pulled, servant = pair.pull()
    servant.awake.clear()
    pair.out.write(long(1))
    pair.far.manager.run_for(100 * PERIOD_US)
    assert (pair.numbers, pulled.state) == ([], PeerState.CONNECTED)
    servant.awake.set()
    pair.until(lambda: pair.numbers[:1] == [1])


def test_a_killed_peer_is_lost_in_a_line_and_found_again(
    pair: Pair, caplog: pytest.LogCaptureFixture
) -> None:
    held, pulled, servant = pair.pull({"buffer.read.empty_policy": "do_nothing"})
    pair.out.write(long(1))
    pair.until(lambda: pair.numbers == [1])
    with caplog.at_level(logging.WARNING):
        servant.kill()
        pair.until(lambda: pulled.state is PeerState.LOST)
        pair.near.serve(answer_get(held), servant.port)
        pair.until(lambda: pair.out.write(long(2)) is OK and 2 in pair.numbers)
    assert pulled.state is PeerState.CONNECTED
    lost, found = [record.getMessage() for record in caplog.records]
    assert lost.startswith("near/ConsoleIn0.rtc:out to ConsoleOut0.in: the peer does not answer: C")
    assert found.startswith("near/ConsoleIn0.rtc:out to ConsoleOut0.in: the peer answers again")


def test_bytes_that_are_no_value_are_passed_over(
    pair: Pair, caplog: pytest.LogCaptureFixture
) -> None:
    _, _, servant = pair.pull()
    servant.kill()
    payloads = [b"\0\xff", b"\0\xff", b"\0" + bytes(8) + b"\5\0\0\0"]
    again = pair.near.serve(
        lambda message: payloads.pop(0) if payloads else bytes([PortStatus.BUFFER_EMPTY]),
        servant.port,
    )
    pair.until(lambda: pair.numbers == [5])
    wrong = [record for record in caplog.records if "no value" in record.getMessage()]
    assert len(wrong) == 1
    again.kill()


def test_a_value_that_does_not_fit_its_type_is_not_held(pair: Pair) -> None:
    held, _, _ = pair.pull()
    assert pair.out.write(long(2**31)) is PortStatus.INVALID_ARGS
    assert len(held.buffer) == 0


def test_after_the_end_of_a_connector_nothing_is_fetched(pair: Pair) -> None:
    held, pulled, _ = pair.pull()
    pair.out.write(long(1))
    pulled.end()
    held.end()
    for _ in range(5):
        pair.near.step()
        pair.far.step()
    assert (held.get(), pair.numbers) == ((PortStatus.CONNECTION_LOST, None), [])


def test_a_full_buffer_says_so_to_the_writer(pair: Pair) -> None:
    held, _, _ = pair.pull({"buffer.length": "1", "buffer.write.full_policy": "do_nothing"})
    assert pair.out.write(long(1)) is OK
    assert pair.out.write(long(2)) is PortStatus.BUFFER_FULL
    assert len(held.buffer) == 1


def test_a_system_that_has_ended_fetches_nothing_more(pair: Pair) -> None:
    _, _, servant = pair.pull()
    pair.out.write(long(1))
    pair.far.calls.close()
    for _ in range(3):
        pair.near.step()
        pair.far.step()
    servant.kill()
    assert pair.numbers == []
