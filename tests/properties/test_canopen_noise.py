"""Whatever is on the bus, the slave of the reference dictionary lives on."""

from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.device.canopen.reference import NODE_ID, make_dictionary
from tests.device.canopen.slave_bench import Bus
from tests.soak import examples
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.can import CanFrame

services = [0x000, 0x080, 0x085, 0x100, 0x205, 0x305, 0x605, 0x705, 0x707, 0x7E5]
can_ids = st.sampled_from(services) | st.integers(0, 0x7FF)
frames = st.builds(CanFrame, can_ids, st.binary(max_size=8)) | st.builds(
    CanFrame, can_ids, st.just(b""), st.just(True), st.booleans(), st.integers(0, 8)
)


@settings(max_examples=examples(80))
@given(st.lists(st.lists(frames, max_size=6).map(tuple), max_size=40))
def test_any_frames_leave_the_slave_able_to_answer_an_sdo(
    ticks: list[tuple[CanFrame, ...]],
) -> None:
    bus = Bus(make_slave(make_dictionary(()), NODE_ID))
    bus.step()
    for rx in ticks:
        bus.now_us += 1_000
        bus.slave.tick(bus.now_us, rx)
    bus.step("7E5#0400000000000000", "000#8000")  # noise may have stopped it, or given it an LSS id
    node_id = bus.slave.node_id
    bus.run(2_000)  # a bit rate that LSS activated is silent for a while
    bus.step(f"{0x600 + node_id:03X}#8000000000000000")
    answer = bus.step(f"{0x600 + node_id:03X}#4000100000000000")
    assert f"{0x580 + node_id:03X}#4300100091010F00" in answer
