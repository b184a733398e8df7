from __future__ import annotations

from itertools import product

import pytest

from tests.device.canopen.ds402.wheel import Wheel
from tickrig.device.canopen.ds402.automaton import Command, command_of
from tickrig.wire.canopen.drive import DriveState

NOT_READY = DriveState.NOT_READY_TO_SWITCH_ON
SOD = DriveState.SWITCH_ON_DISABLED
READY = DriveState.READY_TO_SWITCH_ON
ON = DriveState.SWITCHED_ON
ENABLED = DriveState.OPERATION_ENABLED
QUICK_STOP = DriveState.QUICK_STOP_ACTIVE
REACTION = DriveState.FAULT_REACTION_ACTIVE
FAULT = DriveState.FAULT

MOVES = {
    (SOD, Command.SHUTDOWN): READY,  # 2
    (READY, Command.SWITCH_ON): ON,  # 3
    (READY, Command.ENABLE_OPERATION): ENABLED,  # 3 and 4
    (READY, Command.DISABLE_VOLTAGE): SOD,  # 7
    (READY, Command.QUICK_STOP): SOD,  # 7
    (ON, Command.ENABLE_OPERATION): ENABLED,  # 4
    (ON, Command.SHUTDOWN): READY,  # 6
    (ON, Command.DISABLE_VOLTAGE): SOD,  # 10
    (ON, Command.QUICK_STOP): SOD,  # 10
    (ENABLED, Command.SWITCH_ON): ON,  # 5
    (ENABLED, Command.SHUTDOWN): READY,  # 8
    (ENABLED, Command.DISABLE_VOLTAGE): SOD,  # 9
    (ENABLED, Command.QUICK_STOP): QUICK_STOP,  # 11
    (QUICK_STOP, Command.DISABLE_VOLTAGE): SOD,  # 12
    (QUICK_STOP, Command.ENABLE_OPERATION): ENABLED,  # 16
    **{(NOT_READY, command): SOD for command in Command},  # 1, by itself
    **{(REACTION, command): FAULT for command in Command},  # 14, by itself
}
"""CiA 402-2, finite state automaton: where a command leads to; elsewhere to nowhere."""


@pytest.mark.unmeasured
@pytest.mark.parametrize(("state", "command"), [*product(DriveState, Command)])
def test_a_command_leads_where_the_automaton_says(state: DriveState, command: Command) -> None:
    wheel = Wheel()
    wheel.write(0x605A, 6)  # stays in Quick stop active
    wheel.drive.automaton.enter(state)
    wheel.drive.automaton.obey(command)
    wheel.drive.request()
    wheel.step()
    assert wheel.drive.state is MOVES.get((state, command), state)


@pytest.mark.parametrize(
    ("controlword", "command"),
    [
        (0x0006, Command.SHUTDOWN),
        (0x0007, Command.SWITCH_ON),
        (0x000F, Command.ENABLE_OPERATION),
        (0x0000, Command.DISABLE_VOLTAGE),
        (0x0002, Command.QUICK_STOP),
        (0x0080, None),
        (0x0186, None),
    ],
)
def test_bits_of_the_controlword_make_a_command(controlword: int, command: Command | None) -> None:
    assert command_of(controlword) is command


@pytest.mark.parametrize(
    ("state", "word"),
    [
        (SOD, 0x0350),
        (READY, 0x0331),
        (ON, 0x0333),
        (ENABLED, 0x0337),
        (QUICK_STOP, 0x0317),
        (FAULT, 0x0318),
    ],
)
def test_the_statusword_shows_the_state(state: DriveState, word: int) -> None:
    wheel = Wheel()
    wheel.write(0x6060, 3)
    wheel.write(0x605A, 6)
    wheel.drive.automaton.enter(state)
    wheel.drive.request()
    wheel.step()
    assert wheel.read(0x6041) & 0x03FF == word


def test_without_supply_no_voltage_is_enabled() -> None:
    wheel = Wheel()
    wheel.set(supply_v=5.0)
    wheel.run(2)
    assert wheel.read(0x6041) & 0x0010 == 0
