"""How an LSS slave finds out that it is meant (CiA 305, switch, identify and fastscan)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final

from tickrig.wire.canopen.lss import FASTSCAN_RESET, FastScan, LssAddress, LssMode

MAX_BIT: Final = 31
MAX_SUB: Final = 3

Test = Callable[[LssAddress, int], bool]

SELECTIVE: Final[tuple[Test, ...]] = (
    lambda address, number: address.vendor == number,
    lambda address, number: address.product == number,
    lambda address, number: address.revision == number,
    lambda address, number: address.serial == number,
)
"""Switch state selective: the whole LSS address."""

IDENTIFY: Final[tuple[Test, ...]] = (
    *SELECTIVE[:2],
    lambda address, low: low <= address.revision,
    lambda address, high: address.revision <= high,
    lambda address, low: low <= address.serial,
    lambda address, high: address.serial <= high,
)
"""Identify remote slave: revision and serial number in a range, bounds included."""


class Question:
    """A question in several messages; a wrong one or a missing one ends it.

    Args:
        tests: one for each message, in their order.
    """

    def __init__(self, tests: tuple[Test, ...]) -> None:
        self._tests, self._step = tests, 0

    def ask(self, step: int, address: LssAddress, number: int) -> bool:
        """Hear a message; return whether it was the last one and all of them fit."""
        if step == 0:
            self._step = 0
        if step != self._step or not self._tests[step](address, number):
            self._step = len(self._tests)
            return False
        self._step += 1
        return self._step == len(self._tests)


class FastScanner:
    """Follows a fastscan: one part of the LSS address after the other."""

    def __init__(self) -> None:
        self._sub = 0

    def ask(self, request: FastScan, address: LssAddress) -> LssMode | None:
        """Hear a request; return the state after it if it is answered, else None."""
        if request.bit_check == FASTSCAN_RESET:
            self._sub = 0
            return LssMode.WAITING
        if request.bit_check > MAX_BIT or request.sub != self._sub:
            return None
        if (address[self._sub] ^ request.id_number) >> request.bit_check:
            return None
        if request.bit_check:
            return LssMode.WAITING
        return self._advance(request)

    def _advance(self, request: FastScan) -> LssMode | None:
        """Go on to the next part; the part before it means that all were found."""
        if request.next_sub > MAX_SUB:
            return None
        self._sub = request.next_sub
        return LssMode.CONFIGURATION if request.next_sub < request.sub else LssMode.WAITING
