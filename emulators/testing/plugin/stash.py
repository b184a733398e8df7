"""What a test keeps while it runs, and tests that their bench cannot run."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, Final

import pytest

if TYPE_CHECKING:
    from tickrig.emulators.testing.plugin.benched_test import BenchedTest

BENCHED: Final[pytest.StashKey[BenchedTest]] = pytest.StashKey()
"""Of a test that asked for a bench."""

_ERRORS: Final = "tickrig.emulators.testing.bench.errors"


def is_blocked(error: BaseException) -> bool:
    """Say whether a test came to no verdict about its device."""
    errors = sys.modules.get(_ERRORS)
    return errors is not None and isinstance(error, errors.BenchBlocked)


@contextmanager
def skipped_where_it_cannot() -> Iterator[None]:
    """Skip the test if it asks for what this bench cannot do."""
    try:
        yield
    except Exception as error:
        errors = sys.modules.get(_ERRORS)
        if errors is None or not isinstance(error, errors.NotOnThisBench):
            raise
        skip = pytest.skip.Exception(str(error), _use_item_location=True)
        raise skip.with_traceback(error.__traceback__) from None
