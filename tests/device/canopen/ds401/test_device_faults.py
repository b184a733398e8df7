from __future__ import annotations

import pytest

from tests.device.canopen.ds401.board import I16, NODE_ID, U8, Board, Row, make_dictionary
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.stack import make_slave
from tickrig.device.physical import SignalType
from tickrig.wire.canopen.eds.object_table import RW, EntryDescription
from tickrig.wire.canopen.nmt import NmtState

ROWS: list[Row] = [(0x6200, 1, U8, 0x01), (0x6207, 1, U8, 0xF0), (0x6401, 1, I16, 0)]


@pytest.fixture
def board() -> Board:
    made = Board(ROWS)
    made.start()
    return made


@pytest.mark.parametrize(
    ("fault", "come", "register", "put"),
    [
        ("internal_failure", "085#0050010000000000", 1, 0xF0),
        ("output_overload", "085#1023030000000000", 3, 0xF0),
        ("input_overcurrent", "085#1021030000000000", 3, 0x01),
    ],
)
def test_a_fault_is_told_when_it_comes_and_when_it_goes(
    board: Board, fault: str, come: str, register: int, put: int
) -> None:
    assert board.set(**{fault: 1}) == [come]
    assert (board.see(0x1001, 0), board.put("do")) == (register, put)
    assert board.run(3) == []
    assert board.set(**{fault: 0}) == ["085#0000000000000000"]


def test_a_module_has_the_faults_of_its_terminals() -> None:
    assert Board([]).module.inputs.names(SignalType.FAULT) == ("internal_failure",)
    assert Board([(0x6411, 1, I16, 0)]).module.inputs.names(SignalType.FAULT) == (
        "internal_failure",
        "output_overload",
    )


def test_a_fault_that_is_still_there_keeps_error_values_in_operational(board: Board) -> None:
    board.set(internal_failure=1)
    board.step("000#8005")
    board.step("000#0105")
    assert board.put("do") == 0xF0
    board.set(internal_failure=0)
    board.step("000#8005")
    board.step("000#0105")
    assert board.put("do") == 0x01


def test_after_a_reset_a_fault_is_told_again(board: Board) -> None:
    board.set(output_overload=1)
    assert board.step("000#8105") == ["085#1023030000000000", "705#00"]
    assert board.put("do") == 0xF0


@pytest.mark.parametrize(
    ("behaviour", "state"),
    [(0, NmtState.PRE_OPERATIONAL), (1, NmtState.OPERATIONAL), (2, NmtState.STOPPED)],
)
@pytest.mark.parametrize(("fault", "sub"), [("output_overload", 2), ("input_overcurrent", 3)])
def test_1029h_decides_about_the_nmt_state(
    fault: str, sub: int, behaviour: int, state: NmtState
) -> None:
    plain = make_dictionary(ROWS)
    entry = EntryDescription(0x1029, sub, "behaviour", U8, RW, default=behaviour)
    slave = make_slave(Dictionary([*plain.description, entry]), NODE_ID, application=Ds401)
    bus = Bus(slave)
    bus.step()
    bus.step("000#0105")
    Ds401.of(slave).inputs.set(fault, 1)
    assert len(bus.step()) == 1  # the EMCY is sent before the node is Stopped
    assert slave.state is state


def test_without_its_sub_index_a_fault_leaves_the_nmt_state(board: Board) -> None:
    board.set(output_overload=1)
    assert board.slave.state is NmtState.OPERATIONAL
