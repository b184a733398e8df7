"""Words of a drive and the states that they tell (CiA 402-2)."""

from __future__ import annotations

import pytest

from tickrig.wire.canopen.drive import Controlword, DriveState, Statusword, state_of


def test_the_bits_are_those_of_the_standard() -> None:
    assert [int(bit) for bit in Controlword] == [1 << at for at in range(10)]
    assert [bit.name for bit in Controlword] == [
        *("SWITCH_ON", "ENABLE_VOLTAGE", "QUICK_STOP", "ENABLE_OPERATION"),
        *("START", "CHANGE_AT_ONCE", "RELATIVE", "FAULT_RESET", "HALT", "CHANGE_ON_SET_POINT"),
    ]
    assert {bit.name: int(bit) for bit in Statusword} == {
        "VOLTAGE_ENABLED": 1 << 4,
        "WARNING": 1 << 7,
        "REMOTE": 1 << 9,
        "TARGET_REACHED": 1 << 10,
        "INTERNAL_LIMIT": 1 << 11,
        "MODE_12": 1 << 12,
        "MODE_13": 1 << 13,
        "HOMED": 1 << 15,
    }


@pytest.mark.parametrize("state", DriveState)
@pytest.mark.parametrize("other_bits", [0x0000, 0x1610, 0xFF90])
def test_a_state_is_known_by_its_bits_whatever_the_others_are(
    state: DriveState, other_bits: int
) -> None:
    assert state_of(state | other_bits) is state


@pytest.mark.parametrize(
    ("statusword", "state"),
    [(0x0028, DriveState.FAULT), (0x0060, DriveState.SWITCH_ON_DISABLED), (0x0002, None)],
)
def test_bit_5_counts_only_where_the_standard_names_it(
    statusword: int, state: DriveState | None
) -> None:
    assert state_of(statusword) is state
