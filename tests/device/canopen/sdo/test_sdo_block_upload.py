from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.device.canopen.sdo_client import Client, booted, pattern
from tickrig.wire.canopen.sdo_frame import BlockUploadInitiateRequest

NAME_SEGMENTS = ["585#017265666572656E", "585#02636520736C6176", "585#8365000000000000"]
BEGUN = ["585#C60810000F000000"]
START = "605#A300000000000000"
ENDED = "605#A100000000000000"


def test_15_bytes_come_in_3_segments() -> None:
    bus = booted()
    assert bus.step("605#A40810007F000000") == BEGUN  # BU-01
    assert bus.step(START) == NAME_SEGMENTS
    assert bus.step("605#A2037F0000000000") == ["585#D917B50000000000"]
    assert bus.step(ENDED) == []
    assert bus.step(ENDED) == ["585#8000000001000405"]


def test_without_crc_the_field_is_0() -> None:
    bus = booted()
    assert bus.step("605#A00810007F000000") == ["585#C20810000F000000"]  # BU-02
    assert bus.step(START) == NAME_SEGMENTS
    assert bus.step("605#A2037F0000000000") == ["585#D900000000000000"]


def test_a_lost_segment_is_sent_again() -> None:
    bus = booted()
    bus.step("605#A40810007F000000")
    bus.step(START)
    assert bus.step("605#A2017F0000000000") == ["585#01636520736C6176", "585#8265000000000000"]
    assert bus.step("605#A2007F0000000000") == ["585#01636520736C6176", "585#8265000000000000"]
    assert bus.step("605#A202000000000000") == ["585#D917B50000000000"]  # no more blocks: no size


@pytest.mark.parametrize("block_size", [0, 128, 255])
def test_an_impossible_block_size_is_aborted(block_size: int) -> None:
    bus = booted()
    assert bus.step(f"605#A4081000{block_size:02X}000000") == ["585#8008100002000405"]  # BU-04/05
    bus.step("605#A408100001000000")
    bus.step(START)
    assert bus.step(f"605#A201{block_size:02X}0000000000") == ["585#8008100002000405"]
    assert bus.step(START) == ["585#8000000001000405"]


def test_more_acknowledged_than_sent_is_aborted() -> None:
    bus = booted()
    bus.step("605#A40810007F000000")
    bus.step(START)
    assert bus.step("605#A2047F0000000000") == ["585#8008100003000405"]  # BU-07


@pytest.mark.parametrize(
    ("begin", "answer"),
    [
        ("A40810007F0F0000", "410810000F000000"),  # BU-08
        ("A40810007F0E0000", "C60810000F000000"),
        ("A400100014040000", "4300100091010F00"),
        ("A400100014000000", "C600100004000000"),  # BU-10
        ("A404200014000000", "8004200001000106"),  # BU-09
        ("A4FF3F0014000000", "80FF3F0000000206"),
    ],
)
def test_the_begin_says_what_follows(begin: str, answer: str) -> None:
    assert booted().step(f"605#{begin}") == [f"585#{answer}"]


def test_a_switched_upload_goes_on_in_segments() -> None:
    bus = booted()
    bus.step("605#A40810007F0F0000")
    assert bus.step("605#6000000000000000") == ["585#007265666572656E"]


def test_an_empty_value_is_one_empty_segment() -> None:
    bus = booted()
    assert bus.step("605#A40820007F000000") == ["585#C608200000000000"]
    assert bus.step(START) == ["585#8100000000000000"]
    assert bus.step("605#A2017F0000000000") == ["585#DD00000000000000"]


@pytest.mark.parametrize(
    "steps",
    [
        ["A40810007F000000"],
        ["A40810007F000000", "A300000000000000"],
        ["A40810007F000000", "A300000000000000", "A2037F0000000000"],
    ],
)
def test_every_state_times_out_ends_and_begins_anew(steps: list[str]) -> None:
    wrong = booted(), "605#A300000000000000" if len(steps) != 1 else ENDED
    abort, silence, anew = (booted(), "605#8008100000000008"), booted(), booted()
    for bus in (wrong[0], abort[0], silence, anew):
        for step in steps:
            assert bus.step(f"605#{step}")
    assert wrong[0].step(wrong[1]) == ["585#8008100001000405"]
    assert abort[0].step(abort[1]) + abort[0].run(6_000) == []
    assert silence.run(5_000) == ["585#8008100000000405"]
    assert anew.step("605#4000100000000000") == ["585#4300100091010F00"]


@pytest.mark.unmeasured
@pytest.mark.parametrize("block_size", range(1, 128))
def test_every_block_size_serves(block_size: int) -> None:
    bus = booted()
    for size in (1, 7 * block_size - 1, 7 * block_size, 7 * block_size + 1, 2_000):
        bus.slave.dictionary[0x2008, 0].value = pattern(size)
        assert Client(bus).block_upload(0x2008, [block_size]) == pattern(size)


@pytest.mark.unmeasured
@given(st.integers(1, 3_000), st.lists(st.integers(1, 127), min_size=1, max_size=20))
def test_the_block_size_may_change_with_every_block(size: int, sizes: list[int]) -> None:
    bus = booted()
    bus.slave.dictionary[0x2008, 0].value = pattern(size)
    assert Client(bus).block_upload(0x2008, sizes) == pattern(size)


@pytest.mark.unmeasured
@given(st.integers(1, 600), st.lists(st.integers(0, 5), max_size=50))
def test_the_data_arrives_whatever_is_acknowledged(size: int, receipts: list[int]) -> None:
    bus = booted()
    bus.slave.dictionary[0x2008, 0].value = pattern(size)
    client = Client(bus)
    client.ask(BlockUploadInitiateRequest(0x2008, 0, crc=True, block_size=5))
    replies = bus.step(START)
    got = b""
    while not replies[0].startswith(("585#C", "585#D")):
        taken = min(receipts.pop() if receipts else 5, len(replies))
        got += b"".join(bytes.fromhex(reply[6:]) for reply in replies[:taken])
        replies = bus.step(f"605#A2{taken:02X}050000000000")
    assert got[:size] == pattern(size)
    assert len(got) - size == int(replies[0][4:6], 16) >> 2 & 7
