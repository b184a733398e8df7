"""Coroutines that a test makes and forgets: what stands in them never happens."""

from __future__ import annotations

import re
import sys
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any, Final

from tickrig.emulators.testing.host_clock.host_code import place_of

WARNING: Final = r"coroutine '.*' was never awaited"
"""How Python warns of it, when such a coroutine is thrown away."""

TOLD: Final = re.compile(r"coroutine '(.*)' was never awaited(?s:.*)  File \"(.*)\", line (\d+)")


@contextmanager
def never_awaited(note: Callable[[str], None]) -> Iterator[None]:
    """Note coroutines that are thrown away without having run, whatever filters warnings.

    Args:
        note: called with a line.
    """
    depth = sys.get_coroutine_origin_tracking_depth()
    with warnings.catch_warnings():
        warnings.filterwarnings("always", WARNING, RuntimeWarning)
        show = warnings.showwarning

        def showwarning(message: Warning | str, *where: Any, **more: Any) -> None:
            if told := TOLD.match(str(message)):
                name, file, line = told.groups()
                note(f"{name} was called and not awaited at {place_of(file, int(line))}")
            show(message, *where, **more)

        warnings.showwarning = showwarning
        sys.set_coroutine_origin_tracking_depth(max(1, depth))
        try:
            yield
        finally:
            sys.set_coroutine_origin_tracking_depth(depth)
