from __future__ import annotations

import pytest

import tickrig
from tickrig.device.physical import InputBank, InputSignal, QuantityBank, SignalType


def bank() -> InputBank:
    level = InputSignal("level_v", "a level", low=-5, high=5, unit="V", initial=1)
    return InputBank(
        [level, InputSignal("key", "a key", SignalType.BUTTON), InputSignal("gauge", "", high=9)]
    )


def test_an_input_begins_at_its_initial_value() -> None:
    assert bank()["level_v"] == 1


def test_a_change_is_noticed() -> None:
    inputs = bank()
    inputs.changed = False
    inputs.set("level_v", -5)
    assert (inputs["level_v"], inputs.changed) == (-5, True)


@pytest.mark.parametrize(
    ("name", "value", "reason"),
    [
        ("level_v", 6, "level_v 6 is not in -5..5 V"),
        ("gauge", -1, "gauge -1 is not in 0..9"),
        ("gauge", 1.5, "gauge takes a whole number, not 1.5"),
        ("gauge", "9", "gauge takes a whole number, not '9'"),
        ("gauge", True, "gauge takes a whole number, not True"),
        ("smell", 1, "no input 'smell'; known: level_v, key, gauge"),
    ],
)
def test_a_wrong_input_says_what_is_allowed(name: str, value: float | str, reason: str) -> None:
    inputs = bank()
    inputs.changed = False
    with pytest.raises(ValueError, match=reason):
        inputs.set(name, value)
    assert not inputs.changed


def test_an_input_of_another_kind_is_not_found() -> None:
    assert bank().find("key", SignalType.BUTTON).name == "key"
    with pytest.raises(ValueError, match="no button 'level_v'; known: key"):
        bank().find("level_v", SignalType.BUTTON)
    with pytest.raises(ValueError, match="no fault 'key'; known: none"):
        bank().find("key", SignalType.FAULT)


def test_a_bank_of_whole_numbers_takes_no_real_input() -> None:
    supply = InputSignal("supply_v", "supply voltage", high=15, unit="V", initial=12.5, real=True)
    told = "InputBank takes whole numbers, and supply_v is real: use QuantityBank"
    with pytest.raises(ValueError, match=told):
        InputBank([supply])
    with pytest.raises(ValueError, match=told):
        InputBank(iter([InputSignal("key", "a key", SignalType.BUTTON), supply]))


def test_a_bank_of_quantities_keeps_fractions() -> None:
    supply = InputSignal("supply_v", "supply voltage", high=15, unit="V", initial=12.5, real=True)
    inputs = QuantityBank([supply])
    assert inputs["supply_v"] == 12.5
    inputs.set("supply_v", 11.75)
    assert inputs["supply_v"] == 11.75


def test_both_banks_are_at_the_public_door() -> None:
    assert (tickrig.InputBank, tickrig.QuantityBank) == (InputBank, QuantityBank)


@pytest.mark.parametrize("kind", [InputBank, QuantityBank])
def test_a_value_that_is_assigned_names_the_call(kind: type[QuantityBank]) -> None:
    bank = kind([InputSignal("key", "a key", SignalType.BUTTON)])
    with pytest.raises(TypeError, match=r"an input is set by a call: bank.set\('key', 1\)"):
        bank["key"] = 1
    assert bank["key"] == 0
