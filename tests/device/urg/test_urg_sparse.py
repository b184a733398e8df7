from __future__ import annotations

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.device.urg.measured import Measured
from tickrig.device.urg.terminals import OUTPUTS
from tickrig.device.urg.world import Post, World

lines = st.sampled_from(
    [
        *("BM", "QT", "RS", "TM0", "TM1", "TM2", "VV", "PP", "II", "CR05", "CR99", "HS1"),
        *("GD0380038801", "GS0380038803", "MD0384038401000", "MD0384038601102", "MS0384038401003"),
        *("XX", "MD03", "SS115200"),
        *("SCIP2.0", "V", "L0", "L1", "G38038603", "S1152000000000"),
    ]
).map(lambda line: line.encode() + b"\n")
input_changes = st.tuples(
    st.sampled_from(["laser_broken", "motor_jammed", "power_cut", "post_radius_m"]),
    st.integers(0, 1),
)
steps = st.lists(
    st.tuples(lines | input_changes | st.binary(max_size=20), st.integers(1, 300)), max_size=15
)


@settings(max_examples=60)
@given(steps, st.sampled_from(["1.1", "2.0"]))
def test_idle_ticks_are_not_visible(
    played: list[tuple[bytes | tuple[str, int], int]], scip: str
) -> None:
    world = World(posts=(Post(2, 0, 0.5),))
    dense, sparse = (Measured(world, dense=dense, noise=0.5, scip=scip) for dense in (True, False))
    for what, pause_ms in played:
        for measured in (dense, sparse):
            if isinstance(what, tuple):
                measured.urg.inputs.set(*what)
                measured.run(pause_ms)
            else:
                measured.run(pause_ms, what)
        assert sparse.sent == dense.sent
        for output in OUTPUTS:
            assert sparse.urg.read(output.name) == dense.urg.read(output.name), output.name
