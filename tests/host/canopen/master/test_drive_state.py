"""States by the statusword, and the ways between them (CiA 402-2)."""

from __future__ import annotations

import pytest

from tickrig.device.canopen.ds402 import automaton
from tickrig.host.canopen.master.cia402.drive_state import (
    MODE_BITS,
    TRANSITIONS,
    Controlword,
    DriveState,
    Statusword,
    lead,
    next_state,
    state_of,
)


def test_the_bits_are_those_of_the_standard() -> None:
    assert [int(bit) for bit in Controlword] == [1 << at for at in range(10)]
    assert [bit.name for bit in Controlword] == [
        *("SWITCH_ON", "ENABLE_VOLTAGE", "QUICK_STOP", "ENABLE_OPERATION"),
        *("MODE_4", "MODE_5", "MODE_6", "FAULT_RESET", "HALT", "MODE_9"),
    ]
    assert MODE_BITS == 0b10_0111_0000
    enabled = lead(MODE_BITS, DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED)
    assert enabled == MODE_BITS | 0b1111
    assert {bit.name: int(bit) for bit in Statusword} == {
        "TARGET_REACHED": 1 << 10,
        "MODE_12": 1 << 12,
        "MODE_13": 1 << 13,
    }


def test_a_state_is_named_by_its_words() -> None:
    assert DriveState.of("Switched on") is DriveState.SWITCHED_ON
    assert DriveState.of(DriveState.FAULT) is DriveState.FAULT
    with pytest.raises(ValueError, match=r"no state 'Switchd on'; did you mean 'Switched on'\?"):
        DriveState.of("Switchd on")


@pytest.mark.parametrize("state", automaton.DriveState)
@pytest.mark.parametrize("other_bits", [0x0000, 0x1610, 0xFF90])
def test_a_state_is_known_by_its_bits_whatever_the_others_are(
    state: automaton.DriveState, other_bits: int
) -> None:
    assert state_of(state | other_bits).name == state.name


def test_bits_of_no_state_are_unknown() -> None:
    assert state_of(0x0002) is DriveState.UNKNOWN


@pytest.mark.parametrize("old", [0x0100, 0x018F])
@pytest.mark.parametrize(("before", "after"), list(TRANSITIONS), ids=str)
def test_a_controlword_asks_the_drive_for_the_transition_and_keeps_its_other_bits(
    before: DriveState, after: DriveState, old: int
) -> None:
    word = lead(old, before, after)
    assert word is not None
    assert word & 0x0170 == 0x0100
    command = automaton.command_of(word)
    reached = automaton.NEXT_STATE.get((automaton.DriveState[before.name], command))  # type: ignore[arg-type]
    if before is DriveState.FAULT:
        assert word & 0x80
    elif before is DriveState.FAULT_REACTION_ACTIVE:
        assert word == old
    elif before is not DriveState.NOT_READY_TO_SWITCH_ON:
        assert reached is not None
        assert reached.name == after.name


@pytest.mark.parametrize("state", [state for state in DriveState if state.value != "unknown"])
def test_every_state_leads_to_operation_enabled(state: DriveState) -> None:
    for _ in range(6):
        if state is DriveState.OPERATION_ENABLED:
            return
        following = next_state(state, DriveState.OPERATION_ENABLED)
        assert lead(0, state, following) is not None
        state = following
    raise AssertionError("it takes too many steps")
