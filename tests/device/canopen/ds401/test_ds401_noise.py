"""Whatever comes over the bus and the terminals: no exception, and idle ticks do not matter."""

from __future__ import annotations

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from tests.device.canopen.ds401.board import BOOL, NODE_ID, REAL, U8, Row, make_dictionary
from tests.soak import examples
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.models import f_palette
from tickrig.device.canopen.slave import TICK_US
from tickrig.device.canopen.stack import make_slave
from tickrig.device.physical import SignalType
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.datatypes import DataType

pytestmark = pytest.mark.unmeasured

NUMBERS = [kind for kind in DataType if kind.is_integer or kind is REAL]
INDICES = [
    *(
        index
        for base in (0x6000, 0x6100, 0x6120, 0x6200, 0x6300, 0x6320)
        for index in range(base, base + 9)
    ),
    *range(0x6400, 0x6404),
    *range(0x6410, 0x6414),
    *range(0x6421, 0x6433),
    *range(0x6441, 0x6448),
    *(0x6020, 0x6030, 0x6038, 0x6050, 0x6060, 0x6070, 0x6220, 0x6240, 0x6250, 0x6260, 0x6270),
]
ROWS: list[Row] = [
    *[(0x6000 + offset, 2, U8, 0xFF) for offset in (0, 2, 3, 6, 7, 8)],
    *[(0x6100 + offset, 1, DataType.UNSIGNED16, 0) for offset in (0, 3)],
    *[(0x6200 + offset, 2, U8, 0xFF) for offset in (0, 2, 6, 7, 8)],
    (0x6220, 3, BOOL, 0),
    *[(0x6401 + offset, 2, DataType.INTEGER16, 0) for offset in (0, 0x10)],
    *[(0x6403 + offset, 3, REAL, 0.0) for offset in (0, 0x10)],
    (0x6421, 3, U8, 0x1F),
    (0x6422, 1, DataType.UNSIGNED32, 0),
    *[(0x6424 + offset, 2, DataType.INTEGER32, 5) for offset in range(5)],
    *[(0x6429 + offset, 3, REAL, 0.5) for offset in range(7)],
    *[(0x6431 + offset, 2, DataType.INTEGER32, 1) for offset in (0, 1)],
    *[(0x6441 + offset, 2, REAL, 1.0) for offset in (0, 1, 4)],
    *[(0x6443 + offset, 2, DataType.INTEGER32, 1) for offset in (0, 1, 3, 4)],
]
SENT = (0x6000_0108, 0x6401_0110, 0x6403_0220)

Event = tuple[int, CanFrame | tuple[str, int]]
"""Ticks to wait, then a frame or a terminal (of the module's inputs, by position) and a level."""


@st.composite
def frames(draw: st.DrawFn, indices: list[int]) -> CanFrame:
    kind = draw(st.integers(0, 9))
    if kind == 0:
        command = draw(st.sampled_from([0x01, 0x01, 0x01, 0x02, 0x80, 0x81, 0x82]))
        return CanFrame(0x000, bytes([command, NODE_ID]))
    if kind == 1:
        return CanFrame(draw(st.sampled_from([0x205, 0x305, 0x080])), draw(st.binary(max_size=8)))
    at = draw(st.sampled_from(indices)).to_bytes(2, "little") + bytes([draw(st.integers(0, 3))])
    command = draw(st.sampled_from([0x23, 0x2B, 0x2F, 0x40, 0x22]))
    return CanFrame(0x605, bytes([command]) + at + draw(st.binary(min_size=4, max_size=4)))


levels = st.tuples(st.sampled_from(["lines", "channels", "faults"]), st.integers(0, 2**40))
events = st.lists(st.tuples(st.integers(1, 15), st.one_of(frames(INDICES), levels)), max_size=30)


def set_input(module: Ds401, what: str, level: int) -> None:
    """Set one of the physical inputs to a level that it takes."""
    chosen = {
        "lines": [name for name in module.inputs.table if name.startswith("di")],
        "channels": [name for name in module.inputs.table if name.startswith("ai")],
        "faults": list(module.inputs.names(SignalType.FAULT)),
    }[what]
    if not chosen:
        return
    item = module.inputs.table[chosen[level % len(chosen)]]
    part = (level // 7 % 1000) / 999
    value = item.low + part * (item.high - item.low) if item.real else item.low + level % 2
    module.inputs.set(item.name, value if item.real else int(value))


def run(dictionary: Dictionary, story: list[Event], *, dense: bool) -> list[str]:
    """Play events; return what was sent and how the outputs stood, tick by tick."""
    slave, now_us = make_slave(dictionary, NODE_ID, application=Ds401), 0
    seen: list[str] = []
    module = Ds401.of(slave)

    def tick(*arrived: CanFrame) -> None:
        seen.extend(f"{now_us} {frame}" for frame in slave.tick(now_us, arrived))

    tick(CanFrame(0x000, bytes([1, NODE_ID])))
    for ticks, event in [*story, (50, CanFrame(0x080, b""))]:
        end_us = now_us + ticks * TICK_US
        while now_us + TICK_US < end_us:
            now_us += TICK_US
            if dense or slave.due_us <= now_us:
                tick()
        now_us = end_us
        if isinstance(event, CanFrame):
            tick(event)
        else:
            set_input(module, *event)
            tick()
        seen.append(str({name: module.read(name) for name in module.outputs}))
    return seen


@settings(max_examples=examples(60))
@given(events)
def test_left_out_idle_ticks_are_not_visible(story: list[Event]) -> None:
    dense = run(make_dictionary(ROWS, SENT), story, dense=True)
    assert run(make_dictionary(ROWS, SENT), story, dense=False) == dense


@given(events)
def test_the_f_palette_does_not_depend_on_idle_ticks(story: list[Event]) -> None:
    dense = run(f_palette.dictionary(), story, dense=True)
    assert run(f_palette.dictionary(), story, dense=False) == dense


rows = st.lists(
    st.tuples(st.sampled_from(INDICES), st.integers(1, 3), st.sampled_from(NUMBERS), st.just(0)),
    max_size=12,
    unique_by=lambda row: row[0],
)


@settings(max_examples=examples(60))
@given(rows, events)
@example([(0x6403, 1, DataType.INTEGER56, 0)], [(1, ("channels", 3500))])  # beyond 2**53
def test_any_board_of_any_types_works(board: list[Row], story: list[Event]) -> None:
    sent = run(make_dictionary(board), story, dense=False)
    assert sent[0] == "0 705#00"
