"""Fixtures of the tests of this folder."""

from __future__ import annotations

import pytest

from tests.emulators.lamp import Lamp
from tickrig.emulators.serial.emulator import Emulator


@pytest.fixture
def emulator() -> Emulator:
    return Emulator("lamp", Lamp())
