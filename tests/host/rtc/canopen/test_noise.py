"""Whatever is on the bus, the server does not raise, and goes on."""

from __future__ import annotations

from hypothesis import Phase as HypothesisPhase
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.host.rtc.canopen.bench import EDS, PALETTE_AND_MOTOR, Bench
from tests.soak import examples
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.host.rtc.canopen.serve import read_files, serve
from tickrig.host.rtc.canopen.served_node import NodePhase
from tickrig.host.rtc.canopen.server import RtcCanopenServer
from tickrig.host.rtc.canopen.view import ServerView
from tickrig.wire.can import CanFrame, ErrorState

DEFINITION = parse_definition(PALETTE_AND_MOTOR + "start: {autoactivate: true}")
FILES = read_files(DEFINITION, EDS)
CAN_IDS = (0x000, 0x080, 0x090, 0x190, 0x290, 0x590, 0x5A0, 0x710, 0x720, 0x77F, 0x123)

NO_SHRINKING = (HypothesisPhase.explicit, HypothesisPhase.reuse, HypothesisPhase.generate)

frames = st.builds(
    CanFrame,
    st.sampled_from(CAN_IDS),
    st.binary(max_size=8) | st.sampled_from((b"\0", b"\x04", b"\x05", b"\x7f", b"\x01\x10")),
    st.booleans(),
    st.booleans(),
)
steps = st.tuples(st.sampled_from((0, 1, 1_000, 10_000, 100_000, 600_000)), st.lists(frames))


@settings(max_examples=examples(60))
@given(st.lists(steps, max_size=40), st.lists(st.sampled_from(ErrorState), max_size=2))
def test_noise_is_survived(
    noise: list[tuple[int, list[CanFrame]]], states: list[ErrorState]
) -> None:
    server, now_us = RtcCanopenServer(DEFINITION, FILES), 0
    for state in states:
        server.bus_state(state)
    for wait_us, heard in noise:
        now_us += wait_us
        for frame in server.tick(now_us, tuple((now_us, frame) for frame in heard)):
            frame.checked()
        assert server.due_us > now_us


bursts = st.lists(st.tuples(st.integers(0, 150), st.lists(frames, max_size=6)), max_size=12)


@settings(max_examples=examples(15), phases=NO_SHRINKING)
@given(bursts)
def test_after_noise_the_nodes_can_be_set_up_again(noise: list[tuple[int, list[CanFrame]]]) -> None:
    bench = Bench(PALETTE_AND_MOTOR)
    bench.boot()
    for wait_ms, heard in noise:
        bench.other.send(tuple(f for f in heard if not f.remote and not f.extended))
        bench.run_ms(wait_ms)
    bench.run_ms(1_500)  # a boot-up that nobody sent is taken for a twin's
    for node_id, node in bench.server.nodes.items():
        if node.phase is not NodePhase.READY:
            ServerView(bench.server).boot(node_id)
    serve(bench.server, bench.link, bench.now_us + 4_000_000, lambda: ready(bench))
    assert ready(bench)


def ready(bench: Bench) -> bool:
    return all(node.phase is NodePhase.READY for node in bench.server.nodes.values())
