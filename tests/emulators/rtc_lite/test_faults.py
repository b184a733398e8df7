from __future__ import annotations

import pytest

from tests.wire.rtc_lite.vectors import raw
from tickrig.device.chance import Chance
from tickrig.device.rtc_lite.component import LiteEcho
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.emulators.rig.faults import FaultArguments, FaultTally, FaultTrigger, FaultyPort
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.rtc_lite.line import LINE_FAULTS, Radio, RadioSettings
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.wire.instant import NEVER

PING = raw("0A 43 59 40 01 DD")
STATE = raw("0A 43 58 40 43 1E")


def made(rate: float, seed: int = 0) -> tuple[FaultTrigger, FaultArguments]:
    arguments = FaultArguments(rate=rate)
    return FaultTrigger(Chance(seed), arguments, FaultTally()), arguments


@pytest.mark.parametrize(("rate", "every"), [(1, 1), (0.5, 2), (1 / 3, 3), (0.33, 3), (0.1, 10)])
def test_every_nth_answer_to_a_ping_is_lost(rate: float, every: int) -> None:
    fault = LINE_FAULTS["ping"].make(*made(rate))
    passed = [fault(0, PING) == PING for _ in range(30)]
    assert passed == [(number + 1) % every != 0 for number in range(30)]


def test_what_stands_beside_a_ping_stays() -> None:
    fault = LINE_FAULTS["ping"].make(*made(1))
    assert fault(0, STATE + PING + STATE) == STATE + STATE
    assert fault(0, raw("0A 43 59 01 9D")) == raw("0A 43 59 01 9D")  # the request


def test_noise_comes_before_bytes_and_changes_none() -> None:
    def heard(rate: float) -> bytes:
        return LINE_FAULTS["noise"].make(*made(rate, 3))(0, bytes(1_000))

    assert heard(1)[1::2] == bytes(1_000)
    assert len(set(heard(1)[::2])) > 200
    assert 1_050 < len(heard(0.1)) < 1_150


FIXED = RadioSettings(latency_us=15_000, jitter_us=0, gap_us=2_000, up_us=0)


def radio(settings: RadioSettings, rate: float = 0.0, seed: int = 0) -> Radio:
    return Radio(settings, *made(rate, seed))


def fly(link: Radio, now_us: int) -> int | None:
    """Send a packet, and return how long it took; None for one that was lost."""
    assert link(now_us, b"ab") == b""
    assert link.due_us == now_us + 2_000
    arrived = None
    while arrived is None and (due_us := link.due_us) < NEVER:
        arrived = link.release(due_us)
    assert arrived in (None, b"ab")
    return None if arrived is None else due_us - now_us


def flown(link: Radio, count: int) -> list[int | None]:
    return [fly(link, number * 100_000) for number in range(count)]


def test_a_radio_sends_what_it_took_in_before_a_gap_as_one_packet() -> None:
    link = radio(FIXED)
    for at_us, data in ((0, b"a"), (1_000, b"b"), (5_000, b"c")):
        link(at_us, data)
    assert link.release(17_999) is None
    assert [(due_us, link.release(due_us)) for due_us in (18_000, 22_000)] == [
        (18_000, b"ab"),
        (22_000, b"c"),
    ]
    assert link.due_us == NEVER


def test_a_radio_is_late_by_chance_and_loses_packets_at_its_rate() -> None:
    took = flown(radio(RadioSettings(up_us=0), rate=0.1), 1_000)
    arrived = [each for each in took if each is not None]
    assert 850 < len(arrived) < 950
    assert 17_000 <= min(arrived) < 17_500
    assert 26_500 < max(arrived) <= 27_000
    assert flown(radio(RadioSettings(up_us=0), rate=0.1), 1_000) == took
    assert flown(radio(RadioSettings(up_us=0), rate=0.1, seed=1), 1_000) != took


def test_packets_of_a_radio_keep_their_order() -> None:
    link = radio(RadioSettings(jitter_us=50_000, up_us=0))
    sent = [bytes([number]) for number in range(50)]
    for number, data in enumerate(sent):
        link(number * 3_000, data)
    heard = b""
    while (due_us := link.due_us) < NEVER:
        heard += link.release(due_us) or b""
    assert heard == b"".join(sent)


def test_a_dropout_lasts_seconds_and_is_that_of_both_directions() -> None:
    settings = RadioSettings(jitter_us=0, up_us=10_000_000, dropout_us=2_000_000)
    there, back = radio(settings), radio(settings, seed=5)
    there.pair(back)
    took = [(fly(there, at_us), fly(back, at_us)) for at_us in range(0, 100_000_000, 100_000)]
    assert {pair for pair in took if None in pair} == {(None, None)}
    assert 80 < took.count((None, None)) < 300
    runs = [len(run) for run in "".join("x" if pair[0] is None else " " for pair in took).split()]
    assert all(9 <= run <= 31 for run in runs)


def heard_over_a_radio(*, dense: bool) -> list[int]:
    """Return which of 40 requests were answered."""
    line = SerialLine(57_600)
    port = FaultyPort(line.a, LINE_FAULTS, seed=3)
    port.arm("radio", "0.2")
    rig = Rig(Station(RtcLiteNode(LiteEcho), port), dense=dense)
    heard = []
    for number in range(40):
        line.b.send(rig.now_us, raw("0A 43 58 9B"))
        rig.run_for(100_000)
        if data := line.b.poll(rig.now_us):
            assert data == STATE
            heard.append(number)
    return heard


def test_a_node_behind_a_radio_is_the_same_however_densely_it_is_looked_at() -> None:
    heard = heard_over_a_radio(dense=False)
    assert 15 < len(heard) < 35
    assert heard_over_a_radio(dense=True) == heard


def test_what_a_radio_holds_is_lost_when_it_ends() -> None:
    line = SerialLine(57_600)
    port = FaultyPort(line.a, LINE_FAULTS)
    port.arm("radio", "0.001")
    line.b.send(0, b"abc")
    assert port.poll(5_000) == b""
    assert port.due_us < NEVER
    port.clear("radio")
    assert port.poll(1_000_000) == b""
