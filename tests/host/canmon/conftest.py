"""Fixtures of the tests of this folder."""

from __future__ import annotations

from collections.abc import Iterator

import pytest

from tests.host.canmon.wire import Wire, new_wire


@pytest.fixture
def wire() -> Iterator[Wire]:
    """Return the far end of a virtual bus of python-can."""
    with new_wire() as made:
        yield made
