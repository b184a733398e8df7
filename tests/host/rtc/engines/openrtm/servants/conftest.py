from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.host.rtc.engines.openrtm.servants.served_system import ServedSystem


@pytest.fixture
def system() -> Iterator[ServedSystem]:
    """Return a system that runs, with Spy0 at 100 Hz."""
    system = ServedSystem()
    try:
        yield system
    finally:
        system.close()
