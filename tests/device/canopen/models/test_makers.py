"""Each model is made by one call."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from tickrig.device.canopen.models.epos import make_epos
from tickrig.device.canopen.models.f_palette import make_f_palette
from tickrig.device.canopen.models.motor_core_unit import make_motor_core_unit
from tickrig.device.canopen.slave import CanopenSlave, Nonvolatile
from tickrig.wire.can import CanFrame

MAKERS: dict[int, Callable[..., CanopenSlave]] = {
    1: make_epos,
    16: make_f_palette,
    32: make_motor_core_unit,
}


@pytest.mark.parametrize(("node_id", "make"), MAKERS.items(), ids=MAKERS)
def test_a_model_boots_with_its_node_id_or_another(
    node_id: int, make: Callable[..., CanopenSlave]
) -> None:
    assert make().tick(1_000, ()) == (CanFrame.parse(f"{0x700 + node_id:03X}#00"),)
    assert make(node_id=5).tick(1_000, ()) == (CanFrame.parse("705#00"),)
    kept = Nonvolatile(node_id=7)
    assert make(nonvolatile=kept).tick(1_000, ()) == (CanFrame.parse("707#00"),)


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_slaves_of_a_model_share_its_description(make: Callable[..., CanopenSlave]) -> None:
    first, second = make(), make()
    assert first.dictionary.description is second.dictionary.description
    first.dictionary[0x1017, 0].value = 100
    assert second.dictionary[0x1017, 0].value == 0


@pytest.mark.parametrize("make", MAKERS.values(), ids=MAKERS)
def test_an_impossible_node_id_is_refused(make: Callable[..., CanopenSlave]) -> None:
    with pytest.raises(ValueError, match="node-ID 128 is not in 1"):
        make(node_id=128)
