"""An I/O board by CiA 401: inputs, outputs, events, and what must switch its outputs off."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import pytest

from tests.hil.node import PATIENCE, NodeUnderTest
from tests.hil.rigs import RIGS
from tickrig import Bench

pytestmark = pytest.mark.needs("device:f_palette")

NODE_ID = 16
RPDO1, TPDO1, TPDO2 = 0x200 + NODE_ID, 0x180 + NODE_ID, 0x280 + NODE_ID


@pytest.fixture
def bench_config() -> Path:
    return RIGS / "f_palette.toml"


@pytest.fixture
def board(bench: Bench) -> NodeUnderTest:
    board = NodeUnderTest(bench, NODE_ID)
    board.start()
    return board


def heard(board: NodeUnderTest, cob_id: int) -> list[bytes]:
    """Return what comes under a COB-ID from now on."""
    frames: list[bytes] = []
    board.network.subscribe(cob_id, lambda can_id, data, stamp: frames.append(bytes(data)))
    return frames


def outputs(board: NodeUnderTest) -> int:
    """Return the lamps that are lit."""
    return sum(bool(board.bench.get(f"do{n}")) << (n - 1) for n in range(1, 9))


def test_it_says_what_it_is(board: NodeUnderTest) -> None:
    assert board.read(0x1000) == 0x0007_0191


def test_outputs_follow_sdo_and_pdo(board: NodeUnderTest) -> None:
    board.write(0x6200, 0x81, 1, sub=1)
    assert board.bench.wait_until(lambda: outputs(board) == 0x81, within=PATIENCE)
    board.network.send_message(RPDO1, b"\x7e")
    assert board.bench.wait_until(lambda: outputs(board) == 0x7E, within=PATIENCE)


def test_polarity_turns_an_output_over(board: NodeUnderTest) -> None:
    board.write(0x6202, 0x0F, 1, sub=1)
    board.write(0x6200, 0x00, 1, sub=1)
    assert board.bench.wait_until(lambda: outputs(board) == 0x0F, within=PATIENCE)


@pytest.mark.needs("input:di1")
def test_an_input_is_told_at_once(board: NodeUnderTest) -> None:
    frames = heard(board, TPDO1)
    board.bench.set("di1", 1)
    assert board.bench.wait_until(lambda: frames[-1:] == [b"\x01"], within=PATIENCE)
    board.bench.set("di1", 0)
    assert board.bench.wait_until(lambda: frames[-1:] == [b"\x00"], within=PATIENCE)
    assert board.read(0x6000, 1) == 0


@pytest.mark.needs("input:di1")
def test_an_input_that_is_masked_is_not_told(board: NodeUnderTest) -> None:
    board.write(0x6006, 0xFE, 1, sub=1)
    frames = heard(board, TPDO1)
    board.bench.set("di1", 1)
    board.bench.run_for("200ms")
    assert frames == []
    assert board.read(0x6000, 1) == 1


@pytest.mark.needs("input:ai1_v")
def test_a_voltage_is_measured(board: NodeUnderTest) -> None:
    for volt, value in ((0.0, 0), (1.25, 8_192), (2.5, 16_384), (5.0, 32_760)):
        board.bench.set("ai1_v", volt)
        measured = partial(board.read, 0x6401, 1, signed=True)
        assert board.bench.wait_until(lambda: measured() == value, within=PATIENCE)  # noqa: B023


@pytest.mark.needs("input:ai1_v")
def test_analogue_events_wait_until_they_are_wanted(board: NodeUnderTest) -> None:
    frames = heard(board, TPDO2)
    board.bench.set("ai1_v", 1.25)
    board.bench.run_for("100ms")
    assert frames == []
    board.write(0x6423, 1, 1)
    board.bench.set("ai1_v", 2.5)
    assert board.bench.wait_until(
        lambda: bool(frames) and frames[-1][:2] == b"\x00\x40", within=PATIENCE
    )


def test_outputs_take_their_error_values_when_the_master_is_lost(board: NodeUnderTest) -> None:
    board.write(0x6206, 0xFF, 1, sub=1)
    board.write(0x6207, 0x55, 1, sub=1)
    board.network.send_message(RPDO1, b"\xff")
    assert board.bench.wait_until(lambda: outputs(board) == 0xFF, within=PATIENCE)
    board.write(0x1016, (127 << 16) | 100, 4, sub=1)
    board.network.send_message(0x77F, b"\x05")
    assert board.bench.wait_until(lambda: 0x8130 in board.emergencies, within="5s")
    assert board.bench.wait_until(lambda: outputs(board) == 0x55, within=PATIENCE)


@pytest.mark.needs("fault:power_off")
def test_outputs_are_dark_after_a_power_cut(board: NodeUnderTest) -> None:
    board.network.send_message(RPDO1, b"\xff")
    assert board.bench.wait_until(lambda: outputs(board) == 0xFF, within=PATIENCE)
    boots = board.boots
    board.bench.fault("power_off", for_="100ms")
    assert board.bench.wait_until(lambda: board.boots > boots, within="5s")
    assert outputs(board) == 0


def test_pdos_wait_for_operational(board: NodeUnderTest) -> None:
    board.node.nmt.state = "PRE-OPERATIONAL"
    board.bench.run_for("50ms")
    board.network.send_message(RPDO1, b"\xff")
    board.bench.run_for("100ms")
    assert board.read(0x6200, 1) == 0
