"""Values that objects of a drive take; others are refused with 0609 0030h (CiA 402-2)."""

from __future__ import annotations

from collections.abc import Container, Iterable
from functools import partial
from typing import Final

from tickrig.device.canopen.core.abort import SdoAbort
from tickrig.device.canopen.core.dictionary import Dictionary
from tickrig.device.canopen.core.entry import Entry
from tickrig.device.canopen.ds402.modes.homing_search import METHODS
from tickrig.device.canopen.ds402.motion.trapezoid import RampShape
from tickrig.device.canopen.ds402.objects import indices
from tickrig.wire.canopen.datatypes import Value
from tickrig.wire.canopen.sdo.abort import AbortCode

ALLOWED: Final[dict[int, Container[Value]]] = {
    indices.ABORT_CONNECTION: (0, 1, 2, 3),
    indices.QUICK_STOP_OPTION: (0, 1, 2, 3, 5, 6, 7),
    indices.SHUTDOWN_OPTION: (0, 1),
    indices.DISABLE_OPERATION_OPTION: (0, 1),
    indices.HALT_OPTION: (1, 2, 3),
    indices.FAULT_REACTION_OPTION: (0, 1, 2, 3),
    indices.MOTION_PROFILE: tuple(RampShape),
    indices.HOMING_METHOD: (0, *METHODS),
    indices.INTERPOLATION_SUBMODE: (0,),
}
"""By index; homing method 0 is none."""


def guard_values(dictionary: Dictionary, modes: Iterable[int]) -> None:
    """Have the objects of a drive with some modes of operation refuse other values."""
    for index, allowed in {**ALLOWED, indices.MODES_OF_OPERATION: tuple(modes)}.items():
        entry = dictionary.find(index)
        if entry is not None:
            entry.guard = partial(_check, allowed)


def _check(allowed: Container[Value], entry: Entry, value: Value) -> None:
    if value not in allowed:
        raise SdoAbort(AbortCode.VALUE_RANGE)
