"""States by the statusword, and the ways between them (CiA 402-2)."""

from __future__ import annotations

import pytest

from tickrig.device.canopen.ds402 import automaton
from tickrig.host.canopen.master.cia402.drive_state import (
    MODE_BITS,
    TRANSITIONS,
    lead,
    next_state,
    state_named,
)
from tickrig.wire.canopen.drive import DriveState


def test_the_bits_of_the_mode_are_those_of_the_standard() -> None:
    assert MODE_BITS == 0b10_0111_0000
    enabled = lead(MODE_BITS, DriveState.SWITCHED_ON, DriveState.OPERATION_ENABLED)
    assert enabled == MODE_BITS | 0b1111


def test_a_state_is_named_by_its_words() -> None:
    assert state_named("Switched on") is DriveState.SWITCHED_ON
    assert state_named(DriveState.FAULT) is DriveState.FAULT
    with pytest.raises(ValueError, match=r"no state 'Switchd on'; did you mean 'Switched on'\?"):
        state_named("Switchd on")


def test_only_operation_enabled_has_states_on_the_way() -> None:
    off = DriveState.SWITCH_ON_DISABLED
    assert next_state(DriveState.READY_TO_SWITCH_ON, off) is off


def test_no_controlword_leads_out_of_an_unknown_state() -> None:
    assert next_state(None, DriveState.OPERATION_ENABLED) is DriveState.OPERATION_ENABLED
    assert lead(0, None, DriveState.OPERATION_ENABLED) is None


@pytest.mark.parametrize("old", [0x0100, 0x018F])
@pytest.mark.parametrize(("before", "after"), list(TRANSITIONS), ids=str)
def test_a_controlword_asks_the_drive_for_the_transition_and_keeps_its_other_bits(
    before: DriveState, after: DriveState, old: int
) -> None:
    word = lead(old, before, after)
    assert word is not None
    assert word & 0x0170 == 0x0100
    command = automaton.command_of(word)
    reached = automaton.NEXT_STATE.get((before, command))  # type: ignore[arg-type]
    if before is DriveState.FAULT:
        assert word & 0x80
    elif before is DriveState.FAULT_REACTION_ACTIVE:
        assert word == old
    elif before is not DriveState.NOT_READY_TO_SWITCH_ON:
        assert reached is after


@pytest.mark.parametrize("state", list(DriveState))
def test_every_state_leads_to_operation_enabled(state: DriveState) -> None:
    for _ in range(6):
        if state is DriveState.OPERATION_ENABLED:
            return
        following = next_state(state, DriveState.OPERATION_ENABLED)
        assert lead(0, state, following) is not None
        state = following
    raise AssertionError("it takes too many steps")
