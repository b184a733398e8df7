from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.host.rtc.remote.engine import Pair, joined_systems


@pytest.fixture
def pair() -> Iterator[Pair]:
    """Return ConsoleIn0 of one system and ConsoleOut0 of another one."""
    with joined_systems() as pair:
        yield pair
