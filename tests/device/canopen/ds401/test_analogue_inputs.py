from __future__ import annotations

from functools import partial
from math import inf, isnan, nan

import pytest

from tests.device.canopen.ds401.board import I8, I16, I32, REAL, U8, U16, U32, Board, Row
from tickrig.device.canopen.ds401 import Converter, Ds401
from tickrig.wire.canopen.datatypes import DataType

SUPPLY = Converter("v", "V", low=0.0, high=10.0, high_raw=32767)
with_volts = partial(Ds401, inputs=(SUPPLY,))


def judged(*rows: Row, index: int = 0x6401, kind: DataType = I16) -> Board:
    """Make a running board with one channel whose events are on."""
    mapped = index << 16 | 0x100 | kind.bits
    made = Board([(index, 1, kind, 0), *rows], (mapped,))
    made.start()
    return made


@pytest.mark.parametrize(
    ("index", "kind", "value"),
    [(0x6400, I8, -100), (0x6401, I16, -30_000), (0x6402, I32, -(2**31)), (0x6403, REAL, 0.25)],
)
def test_a_value_of_any_width_is_read_and_sent(index: int, kind: DataType, value: float) -> None:
    made = judged(index=index, kind=kind)
    assert made.set(ai1=value) == [f"185#{kind.encode(value).hex().upper()}"]
    assert made.see(index, 1) == value


@pytest.mark.parametrize(("kind", "low", "high"), [(I16, -32768, 32767), (U16, 0, 65535)])
def test_counts_are_limited_to_the_object(kind: DataType, low: int, high: int) -> None:
    made = judged(kind=kind)
    with pytest.raises(ValueError, match=f"not in {low}"):
        made.set(ai1=high + 1)
    made.set(ai1=high)
    assert made.see(0x6401, 1) == high


def test_channels_may_have_gaps() -> None:
    made = Board([(0x6401, 1, I16, 0), (0x6403, 2, REAL, 0.0)])
    made.set(ai1=7, ai2=0.5)
    assert [made.see(0x6403, sub) for sub in (1, 2)] == [7.0, 0.5]


def test_narrower_objects_have_the_upper_bits() -> None:
    made = Board([(0x6400, 1, I8, 0), (0x6401, 1, I16, 0), (0x6402, 1, I32, 0)])
    made.set(ai1=-0x1234_5678)
    assert [made.see(index, 1) for index in (0x6400, 0x6401, 0x6402)] == [
        -0x13,
        -0x1235,
        -0x1234_5678,
    ]


def test_a_converter_gives_counts_and_the_quantity() -> None:
    rows: list[Row] = [(0x6401, 1, I16, 0), (0x6402, 1, I32, 0), (0x6403, 1, REAL, 0.0)]
    made = Board(rows, make=with_volts)
    made.set(ai1_v=10.0)
    assert [made.see(index, 1) for index in (0x6401, 0x6402)] == [32767, 32767 << 16]
    assert made.see(0x6403, 1) == 10.0
    assert made.module.inputs.table["ai1_v"].unit == "V"


def test_channels_beyond_the_converters_are_counted() -> None:
    made = Board([(0x6401, 2, I16, 0)], make=with_volts)
    assert list(made.module.inputs.table)[:2] == ["ai1_v", "ai2"]


def test_integer_scaling_and_offset_are_applied_in_this_order() -> None:
    made = Board([(0x6401, 1, I16, 0), (0x6431, 1, I32, 0), (0x6432, 1, I32, 0)])
    made.set(ai1=100)
    assert made.see(0x6401, 1) == 100  # a scaling of 0 is taken as 1
    made.write(0x6432, 1, 3)
    made.write(0x6431, 1, -50)
    made.step()
    assert made.see(0x6401, 1) == 250
    made.write(0x6432, 1, 2**31 - 1)
    made.step()
    assert made.see(0x6401, 1) == 32767


def test_real_scaling_and_offset_are_applied_in_this_order() -> None:
    made = Board([(0x6403, 1, REAL, 0.0), (0x642E, 1, REAL, 1.0), (0x642F, 1, REAL, 1.0)])
    made.write(0x642F, 1, 0.5)
    made.set(ai1=8.0)
    assert made.see(0x6403, 1) == 5.0


@pytest.mark.parametrize("factor", [inf, -inf, nan, 3e38])
def test_a_scaling_that_is_no_number_harms_nobody(factor: float) -> None:
    made = judged((0x642F, 1, REAL, 1.0), (0x642B, 1, REAL, 1.0), index=0x6403, kind=REAL)
    made.write(0x642F, 1, factor)
    made.set(ai1=1e30)
    value = made.see(0x6403, 1)
    assert isnan(factor) or value in {inf, -inf}
    assert made.step("605#4000100000000000") == ["585#4300100091010F00"]


@pytest.mark.parametrize(
    ("trigger", "limits", "levels", "sent"),
    [
        (0x01, {0x6424: 1000}, [999, 1000, 1001, 999, 1000], [1000, 1000]),
        (0x02, {0x6425: -100}, [-100, -101, -200, -100, -101], [-101, -101]),
        (0x04, {0x6426: 8}, [8, 9, 1, 0], [9, 0]),
        (0x08, {0x6427: 8}, [100, -8, -9, -17, -18], [-9, -18]),
        (0x10, {0x6428: 8}, [-100, 8, 9, 17, 18], [9, 18]),
        (0x05, {0x6424: 100, 0x6426: 50}, [50, 51, 100, 101], [51, 100]),
        (0x00, {}, [1, 100, 10_000], []),
        (0xE0, {}, [1, 100, 10_000], []),
    ],
)
@pytest.mark.parametrize(("shift", "index", "kind"), [(0, 0x6401, I16), (5, 0x6403, REAL)])
def test_the_trigger_chooses_what_is_sent(  # noqa: PLR0913, PLR0917 - a table
    trigger: int,
    limits: dict[int, int],
    levels: list[int],
    sent: list[int],
    shift: int,
    index: int,
    kind: DataType,
) -> None:
    rows: list[Row] = [
        (0x6424 + shift + offset, 1, REAL if shift else (I32 if offset < 2 else U32), 0)
        for offset in range(5)
    ]
    made = judged((0x6421, 1, U8, 7), *rows, index=index, kind=kind)
    made.write(0x6421, 1, trigger)
    for at, value in limits.items():
        made.write(at + shift, 1, value)
    made.step()
    frames = [frame for level in levels for frame in made.set(ai1=level)]
    assert frames == [f"185#{kind.encode(value).hex().upper()}" for value in sent]


def test_a_limit_without_object_is_none() -> None:
    made = judged((0x6421, 1, U8, 3), (0x6426, 1, U32, 0))
    assert made.set(ai1=1000) == []
    assert made.set(ai1=-1000) == []


def test_the_delta_counts_from_what_the_event_timer_has_sent() -> None:
    made = judged((0x6426, 1, U32, 8))
    made.write(0x1800, 5, 20)
    made.set(ai1=8)
    assert made.run(20) == ["185#0800"]
    assert made.set(ai1=0) == []
    assert made.set(ai1=-1) == ["185#FFFF"]


def test_during_the_inhibit_time_the_newest_value_waits() -> None:
    made = judged((0x6426, 1, U32, 8))
    made.write(0x1800, 1, 0x8000_0185)
    made.write(0x1800, 3, 100)
    made.write(0x1800, 1, 0x185)
    assert made.step() == ["185#0000"]
    assert made.set(ai1=100) == []
    made.set(ai1=103)
    assert made.run(10) == ["185#6700"]
    assert made.run(30) == []
    assert made.set(ai1=111) == []
    assert made.set(ai1=112) == ["185#7000"]


def test_without_6423h_analogue_events_are_on() -> None:
    assert judged().set(ai1=1) == ["185#0100"]


def test_a_value_that_no_pdo_carries_is_an_event_once() -> None:
    made = Board([(0x6401, 2, I16, 0), (0x6422, 1, U32, 0), (0x6426, 2, U32, 8)], (0x6401_0110,))
    made.start()
    made.set(ai2=9)
    assert made.read(0x6422, 1) == 2
    made.set(ai2=10)
    assert made.read(0x6422, 1) == 0


def test_interrupt_sources_are_banks_of_32_channels_and_reading_clears() -> None:
    made = Board([(0x6401, 70, I16, 0), (0x6422, 2, U32, 0)])
    made.set(ai1=1, ai32=1, ai33=1, ai65=1)
    assert [made.read(0x6422, sub) for sub in (1, 2)] == [0x8000_0001, 0x0000_0001]
    assert [made.read(0x6422, sub) for sub in (1, 2)] == [0, 0]
    made.set(ai2=1)
    assert made.read(0x6422, 1) == 2


def test_a_narrow_bank_has_no_bit_for_further_channels() -> None:
    made = Board([(0x6401, 9, I16, 0), (0x6422, 1, U8, 0)])
    made.set(ai8=1, ai9=1)
    assert made.read(0x6422, 1) == 0x80


def test_a_source_that_a_pdo_carries_is_cleared_and_sent_once() -> None:
    made = Board([(0x6401, 1, I16, 0), (0x6422, 1, U32, 0)], (0x6422_0120, 0x6401_0110))
    made.start()
    assert made.set(ai1=1) == ["185#010000000100"]
    assert made.run(5) == []
    assert made.see(0x6422, 1) == 0


def test_the_value_at_boot_is_no_event() -> None:
    made = Board([(0x6401, 1, I16, 0), (0x6422, 1, U32, 0)], (0x6401_0110,))
    made.set(ai1=500)
    made.read(0x6422, 1)
    made.step("000#8105")
    made.run(2)
    assert made.read(0x6422, 1) == 0
    assert made.step("000#0105") == ["185#F401"]
