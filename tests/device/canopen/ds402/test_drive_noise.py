"""Whatever is written into the objects of a drive, it goes on and answers."""

from __future__ import annotations

from contextlib import suppress

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.device.canopen.ds402.wheel import Wheel
from tests.soak import examples
from tickrig.device.canopen.dictionary import SdoAbort
from tickrig.device.canopen.models import epos

pytestmark = pytest.mark.unmeasured

PROFILE = [
    (entry.index, entry.sub, entry.size)
    for entry in epos.dictionary()
    if entry.index >= 0x2000 and entry.description.writable and entry.index not in (0x6040, 0x6060)
]
MODES = [1, 3, 4, 6, 7, 8, 9, 10, -1, -2, -3]
CONTROLWORDS = [0x06, 0x0F, 0x1F, 0x3F, 0x5F, 0x21F, 0x02, 0x80, 0x10F, 0x00]


@st.composite
def writes(draw: st.DrawFn) -> tuple[int, int, bytes]:
    kind = draw(st.integers(0, 5))
    if kind == 0:
        return 0x6060, 0, draw(st.sampled_from(MODES)).to_bytes(1, "little", signed=True)
    if kind < 3:
        return 0x6040, 0, draw(st.sampled_from(CONTROLWORDS)).to_bytes(2, "little")
    index, sub, size = draw(st.sampled_from(PROFILE))
    edges = [bytes(size), bytes([1, *bytes(size - 1)]), b"\xff" * size, b"\x7f" * size]
    return index, sub, draw(st.sampled_from(edges) | st.binary(min_size=size, max_size=size))


@settings(max_examples=examples(60), deadline=None)
@given(st.lists(st.tuples(writes(), st.integers(1, 30)), max_size=25))
def test_no_values_stop_the_drive(steps: list[tuple[tuple[int, int, bytes], int]]) -> None:
    wheel = Wheel()
    wheel.control(0x06, 0x0F)
    for (index, sub, data), pause_ms in steps:
        with suppress(SdoAbort):
            wheel.slave.dictionary[index, sub].download(data)
        wheel.step("080#")
        wheel.run(pause_ms - 1)
    assert wheel.step("601#4000100000000000") == ["581#4300100092010200"]
