from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.device.canopen.profile_objects import DRIVE, GENERIC_IO, make_dictionary
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.ds402 import Ds402
from tickrig.device.canopen.slave import TICK_US, Application
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.can import CanFrame

pytestmark = pytest.mark.unmeasured

PROFILES: list[tuple[type[Application], str, list[int]]] = [
    (Ds401, GENERIC_IO, [0x6002, 0x6003, 0x6005, 0x6008, 0x6202, 0x6207, 0x6208, 0x6421, 0x6423]),
    (Ds402, DRIVE, [0x6007, 0x6040, 0x605A, 0x6060, 0x607A, 0x607C, 0x6098, 0x60FF]),
]
COMMANDS = st.sampled_from([0x06, 0x07, 0x0F, 0x1F, 0x3F, 0x5F, 0x02, 0x80, 0x10F, 0x00])


@st.composite
def requests(draw: st.DrawFn, indices: list[int]) -> CanFrame:
    kind = draw(st.integers(0, 9))
    if kind == 0:
        command = draw(st.sampled_from([0x01, 0x02, 0x80, 0x81, 0x82]))
        return CanFrame(0x000, bytes([command, 5]))
    if kind < 3:
        return CanFrame(draw(st.sampled_from([0x205, 0x305, 0x080])), draw(st.binary(max_size=8)))
    if kind < 6 and 0x6040 in indices:
        return CanFrame(0x605, b"\x2b\x40\x60\x00" + draw(COMMANDS).to_bytes(4, "little"))
    at = draw(st.sampled_from(indices)).to_bytes(2, "little") + bytes([draw(st.integers(0, 1))])
    return CanFrame(0x605, b"\x22" + at + draw(st.binary(min_size=4, max_size=4)))


@given(st.sampled_from(PROFILES), st.data())
def test_profiles_never_raise_and_never_stop_the_node(
    profile: tuple[type[Application], str, list[int]], data: st.DataObject
) -> None:
    application, need, indices = profile
    slave, now_us = make_slave(make_dictionary([need]), 5, application=application), 0
    for frame in data.draw(st.lists(requests(indices), max_size=40)):
        now_us += TICK_US
        slave.tick(now_us, (frame,))
    slave.tick(now_us + TICK_US, (CanFrame(0x000, b"\x80\x05"),))
    answers = slave.tick(now_us + 2 * TICK_US, (CanFrame.parse("605#4000100000000000"),))
    assert "585#4300100091010F00" in [str(frame) for frame in answers]
