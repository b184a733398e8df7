"""What a process can do by itself to keep time: no thread of it holds up the others for long."""

from __future__ import annotations

import gc
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final

SWITCH_S: Final = 0.0005
"""A thread that computes lets others come to their turn after this time (Python: 5 ms)."""


@contextmanager
def keeping_time() -> Iterator[None]:
    """Let threads switch soon, and search no old objects for garbage: that takes 50 ms at once."""
    before_s = sys.getswitchinterval()
    sys.setswitchinterval(SWITCH_S)
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
        sys.setswitchinterval(before_s)
