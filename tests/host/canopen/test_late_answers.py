"""Answers that come late, twice or never: what is returned is of after the question."""

from __future__ import annotations

from collections.abc import Callable, Iterable

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.host.canopen.commissioning.net_bench import NetBench
from tests.host.canopen.late_node import (
    CLOCK,
    DOMAIN,
    NODE_ID,
    NUMBER,
    TEXT,
    TIME,
    LateLink,
    LatePath,
    Passage,
    clock_slave,
)
from tests.host.rtc.canopen.bench import EDS
from tests.soak import examples
from tickrig import Bench
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.tui.panels.dictionary_panel import DictionaryTask
from tickrig.host.canopen.commissioning.node_bus import NodeBus
from tickrig.host.canopen.commissioning.program import download_blocks
from tickrig.host.canopen.conform.bus.exchange import BusExchange
from tickrig.host.canopen.conform.bus.sdo import SdoClient
from tickrig.host.canopen.dialogue import QueuedScript
from tickrig.host.canopen.errors import SdoAborted, SdoFailed, SdoTimeout
from tickrig.host.canopen.gateway import Gateway
from tickrig.host.canopen.master.assignment import MasterPlan, SlaveAssignment
from tickrig.host.canopen.master.canopen_master import CanopenMaster
from tickrig.host.canopen.sdo_transfer import upload
from tickrig.host.links.link import StampedFrames, StampedLink
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.host.rtc.canopen.serve import read_files, serve
from tickrig.host.rtc.canopen.served_node import NodePhase
from tickrig.host.rtc.canopen.server import RtcCanopenServer
from tickrig.wire.can import CanFrame

MS_US = 1_000
BUS = "can0"
TIMEOUT_US = 100 * MS_US
TOO_LATE = Passage(130 * MS_US)
IN_TIME = Passage()


class Late:
    """A clock on a late bus, and a host that reads it by `canmon net`'s client."""

    def __init__(self, answers: Iterable[Passage], requests: Iterable[Passage] = ()) -> None:
        self.slave = clock_slave()
        self.bench = NetBench(self.slave)
        self.link = LateLink(self.bench.host, answers, requests)
        self.bus = NodeBus(self.link, TIMEOUT_US)

    def clock(self, at: tuple[int, int] = CLOCK) -> int:
        """Read the time in ms, and see that it is not of before the question."""
        asked_ms = self.link.now_us // MS_US
        data = self.bus.read(NODE_ID, *at)
        told_ms = int(data) if at == TEXT else int.from_bytes(data, "little")
        assert told_ms >= asked_ms, f"{told_ms} is a value of before {asked_ms}"
        return told_ms

    def write(self, at: tuple[int, int], data: bytes) -> None:
        """Write, and see that it is written."""
        self.bus.write(NODE_ID, *at, data)
        assert self.slave.dictionary[at].data == data

    def sent(self) -> list[str]:
        return [text[4:] for text in self.bench.frames if text.startswith("605#")]


def test_a_late_answer_is_not_taken_for_that_to_the_next_question() -> None:
    late = Late([TOO_LATE, *[IN_TIME] * 99])
    with pytest.raises(SdoTimeout):
        late.clock()
    for _ in range(5):
        late.clock()


def test_after_a_time_out_another_object_is_read_before_the_same_one() -> None:
    late = Late([TOO_LATE, *[IN_TIME] * 99])
    with pytest.raises(SdoTimeout):
        late.clock()
    late.clock()
    assert late.sent() == [
        "4000200000000000",
        "8000200000000405",
        "4000100000000000",
        "4000200000000000",
    ]


def test_after_a_time_out_other_objects_are_read_at_once() -> None:
    late = Late([TOO_LATE, *[IN_TIME] * 99])
    with pytest.raises(SdoTimeout):
        late.clock()
    late.clock(TIME)
    late.clock(CLOCK)
    assert late.sent()[2:] == ["4002200000000000", "4000200000000000"]


def test_a_node_that_is_always_too_slow_is_an_error_and_no_old_value() -> None:
    late = Late([TOO_LATE])
    for _ in range(10):
        with pytest.raises(SdoTimeout, match="2000h:00 was not answered"):
            late.clock()


@pytest.mark.parametrize("late_ms", [110, 210, 350, 990, 5_050])
def test_a_node_that_is_quick_again_is_read_again(late_ms: int) -> None:
    late = Late([Passage(late_ms * MS_US), *[IN_TIME] * 99])
    for _ in range(2 + late_ms // 100):
        try:
            late.clock()
        except SdoTimeout:
            continue
    late.clock()


def test_a_late_segment_is_no_part_of_the_next_transfer() -> None:
    late = Late([IN_TIME, TOO_LATE, *[IN_TIME] * 99])
    with pytest.raises(SdoTimeout):
        late.clock(TEXT)
    late.clock(TEXT)
    late.clock(CLOCK)


def test_a_late_abort_does_not_refuse_the_next_write() -> None:
    late = Late([TOO_LATE, *[IN_TIME] * 99])
    with pytest.raises(SdoTimeout):
        late.bus.write(NODE_ID, *NUMBER, b"too much")
    late.write(NUMBER, b"1234")


def test_a_late_receipt_does_not_confirm_the_next_write() -> None:
    late = Late([TOO_LATE, *[IN_TIME] * 99])
    with pytest.raises(SdoTimeout):
        late.bus.write(NODE_ID, *NUMBER, b"1234")
    with pytest.raises(SdoAborted):
        late.bus.write(NODE_ID, *NUMBER, b"too much")


def test_after_ctrl_c_the_answer_to_what_was_under_way_is_not_that_to_the_next_question(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    late = Late([Passage(50 * MS_US), *[IN_TIME] * 99])
    looks, receive = iter(range(3)), late.link.receive_stamped

    def receive_or_be_ended(timeout_us: int) -> tuple[int, StampedFrames]:
        if next(looks) == 1:
            raise KeyboardInterrupt
        return receive(timeout_us)

    monkeypatch.setattr(late.link, "receive_stamped", receive_or_be_ended)
    with pytest.raises(KeyboardInterrupt):
        late.clock()
    monkeypatch.undo()
    late.clock()


def test_an_answer_that_comes_twice_is_not_that_to_the_next_question() -> None:
    late = Late([Passage(copies=2)])
    for _ in range(5):
        late.clock(CLOCK)
        late.clock(TEXT)
        late.clock(TEXT)
        late.clock(CLOCK)


def test_a_request_that_comes_twice_is_answered_twice_and_read_once() -> None:
    late = Late([IN_TIME], [Passage(copies=2)])
    for _ in range(5):
        late.clock()


def test_a_bus_that_repeats_frames_gives_no_old_value() -> None:
    late = Late([IN_TIME])
    late.bench.wire.faults.arm("duplicate", "0.3")
    for _ in range(30):
        late.clock()


LATENESS = st.sampled_from([0, 0, 0, 1, 7, 90, 99, 101, 130, 199, 250, 600])
LATENESS_US = LATENESS.map(lambda ms: ms * MS_US)
ANSWERS = st.builds(Passage, LATENESS_US, st.sampled_from([1, 1, 1, 1, 0, 2]))
REQUESTS = st.builds(Passage, LATENESS_US, st.sampled_from([1, 1, 1, 1, 0]))
STEPS = st.tuples(st.sampled_from("crtTnNdb"), st.sampled_from([0, 0, 0, 1, 50, 150, 800]))


@settings(max_examples=examples(60), deadline=None)
@given(
    st.lists(STEPS, min_size=2, max_size=12),
    st.lists(ANSWERS, min_size=1, max_size=9),
    st.lists(REQUESTS, min_size=1, max_size=7),
)
def test_however_late_frames_are_a_value_is_of_after_its_question(
    steps: list[tuple[str, int]], answers: list[Passage], requests: list[Passage]
) -> None:
    late = Late(answers, requests)
    dos: dict[str, Callable[[bytes], object]] = {
        "c": lambda _: late.clock(CLOCK),
        "r": lambda _: late.clock(TIME),
        "t": lambda _: late.clock(TEXT),
        "T": lambda _: late.clock(TEXT),
        "n": lambda data: late.write(NUMBER, data[:4]),
        "N": lambda _: late.bus.write(NODE_ID, *NUMBER, b"too much"),
        "d": lambda data: late.write(DOMAIN, data),
        "b": lambda data: _write_blocks(late, data),
    }
    for number, (what, pause_ms) in enumerate(steps, 1):
        late.bus.gather(pause_ms * MS_US)
        try:
            dos[what](b"%04d of a domain" % number)
        except SdoFailed:
            continue
        assert what != "N", "a value that does not fit was taken"


def _write_blocks(late: Late, data: bytes) -> None:
    late.bus.run(NODE_ID, download_blocks(*DOMAIN, data, lambda _: None))
    assert late.slave.dictionary[DOMAIN].data == data


def test_a_gateway_tells_no_value_of_before_its_question() -> None:
    late = Late([TOO_LATE, *[IN_TIME] * 99])
    gateway = Gateway(NodeBus(late.link, 1), 1, "1.2")
    assert gateway.answer("[1] set sdo_timeout 100") == "[1] OK"
    assert "no answer within 100 ms" in gateway.answer("[2] 5 r 0x2000 0 u32")
    for _ in range(5):
        asked_ms = late.link.now_us // MS_US
        assert int(gateway.answer("[3] 5 r 0x2000 0 u32").split()[1]) >= asked_ms


def test_what_a_gateway_has_not_read_while_it_was_idle_answers_nothing() -> None:
    late = Late([Passage(50 * MS_US, copies=2), *[IN_TIME] * 99])
    late.clock()
    late.bench.rig.run_for(1_000 * MS_US)
    late.clock()


def exchange_on(link: StampedLink) -> BusExchange:
    return BusExchange(link, NODE_ID, bit_rate=1_000_000, max_load=1, permit=lambda frame: None)


SLOW = Passage(530 * MS_US)


def test_a_conformance_test_reads_no_value_of_before_its_question() -> None:
    late = Late([SLOW, *[IN_TIME] * 99])
    client = SdoClient(exchange_on(late.link), NODE_ID)
    assert (client.number(*CLOCK) or 0) >= 500, "the answer to the question that was repeated"
    for _ in range(5):
        asked_ms = late.link.now_us // MS_US
        assert (client.number(*CLOCK) or 0) >= asked_ms


def test_what_a_check_has_asked_in_vain_is_not_the_answer_to_what_is_read_after_it() -> None:
    late = Late([Passage(30 * MS_US), *[IN_TIME] * 99])
    exchange = exchange_on(late.link)
    exchange.send(CanFrame.parse("605#4000200000000000"))
    exchange.wait(20)
    asked_ms = late.link.now_us // MS_US
    assert (SdoClient(exchange, NODE_ID).number(*CLOCK) or 0) >= asked_ms


class Asker:
    """Reads the clock again and again, beside what a master does by itself."""

    def __init__(
        self, start: Callable[[int, QueuedScript], None], now_us: Callable[[], int]
    ) -> None:
        self._start, self._now_us = start, now_us
        self.read, self.failed = 0, 0
        self._ask()

    def _ask(self) -> None:
        asked_ms = self._now_us() // MS_US

        def done(data: bytes) -> None:
            told_ms = int.from_bytes(data, "little")
            assert told_ms >= asked_ms, f"{told_ms} is a value of before {asked_ms}"
            self.read += 1
            if self.read < 5:
                self._ask()

        def failed(_: object) -> None:
            self.failed += 1
            self._ask()

        self._start(self._now_us(), QueuedScript("", upload(*CLOCK), done, failed))


def test_the_test_master_reads_no_value_of_before_its_question() -> None:
    with Bench(node5=clock_slave()) as bench:
        link = LateLink(bench.link, [IN_TIME] * 2)  # type: ignore[arg-type]  # it is stamped
        master = CanopenMaster(link, MasterPlan((SlaveAssignment(NODE_ID),)))
        master.boot()
        link.answers = LatePath([TOO_LATE, *[IN_TIME] * 99])
        asker = Asker(master.slave(NODE_ID).dialogue.start, lambda: master.now_us)
        master.run_for("2s")
    assert (asker.read, asker.failed) == (5, 1)


SYSTEM = "nodes: [{id: 5, name: Clock0, eds: f-palette.eds, role: device}]\n"


def test_the_server_reads_no_value_of_before_its_question() -> None:
    late = Late([IN_TIME])
    definition = parse_definition(SYSTEM)
    server = RtcCanopenServer(definition, read_files(definition, EDS))
    serve(server, late.link, late.link.now_us + 100 * MS_US)
    node = server.nodes[NODE_ID]
    assert (node.phase, node.dialogue.job) == (NodePhase.REFUSED, None)  # it is another device
    late.link.answers = LatePath([SLOW, *[IN_TIME] * 99])
    asker = Asker(node.run, lambda: late.link.now_us)
    serve(server, late.link, late.link.now_us + 3_000 * MS_US)
    assert (asker.read, asker.failed) == (5, 1)


def test_a_panel_keeps_in_mind_what_a_node_has_not_answered_while_it_talks_to_another_one() -> None:
    task = DictionaryTask(Decoder())
    task.choose((BUS, NODE_ID))
    task.read(0, CLOCK)
    task.choose((BUS, 9))
    task.choose((BUS, NODE_ID))
    task.read(0, CLOCK)
    assert [str(frame) for frame in task.tick(0, ())] == ["605#4000100000000000"]
