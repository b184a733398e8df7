from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.device.rh3.driven import Driven
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.rh3.terminals import OUTPUTS
from tickrig.wire.modbus.requests import Request, encode_request
from tickrig.wire.modbus.rtu import encode_frame

words = st.sampled_from([0, 1, 2, 3, 4, 5, 6, 0x10, 0x7FFF, 0x8000, 0xFFFF])
pairs = st.tuples(words, words)
orders = st.one_of(
    st.builds(lambda v: Request(6, write=(0x10, (v,))), st.integers(0, 2)),
    st.builds(lambda v: Request(6, write=(0x11, (v,))), st.integers(0, 6)),
    st.builds(lambda v: Request(6, write=(0x12, (v,))), st.sampled_from([0, 50, 500])),
    st.builds(lambda a, v: Request(6, write=(a, (v,))), st.integers(0x20, 0x2C), words),
    st.builds(lambda a, b: Request(16, write=(0x100, (*a, *b))), pairs, pairs),
    st.builds(lambda a, b: Request(16, write=(0x104, (*a, *b))), pairs, pairs),
    st.builds(lambda a, b: Request(23, (0x200, 14), (0x100, (*a, *b))), pairs, pairs),
).map(lambda request: encode_frame(1, encode_request(request)))
input_changes = st.tuples(
    st.sampled_from(["emergency_stop", "bumper", "jam_left", "load_right_nm", "power_cut"]),
    st.integers(0, 1),
)
steps = st.lists(
    st.tuples(orders | input_changes | st.binary(max_size=20), st.integers(3, 400)), max_size=15
)


@settings(max_examples=60)
@given(steps, st.sampled_from([0, 7]))
def test_idle_ticks_are_not_visible(
    played: list[tuple[bytes | tuple[str, int], int]], delay_ms: int
) -> None:
    parameters = BaseParameters(friction=0.1, noise=0.05, seed=3, delay_ms=delay_ms)
    dense, sparse = Driven(parameters), Driven(parameters, dense=False)
    for what, pause_ms in played:
        for driven in (dense, sparse):
            if isinstance(what, tuple):
                driven.base.inputs.set(*what)
                driven.run(pause_ms)
            else:
                driven.run(pause_ms, what)
        assert sparse.sent == dense.sent
        for output in OUTPUTS:
            assert sparse.base.read(output.name) == dense.base.read(output.name), output.name
