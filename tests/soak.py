"""How many examples a search draws: what finds much in a second, and SOAK times as many on demand.

`SOAK=20 pytest -n auto --timeout 0 -m hypothesis` is the long run; examples are others each time.
"""

from __future__ import annotations

import os
from typing import Final

SOAK: Final = int(os.environ.get("SOAK", "1"))


def examples(usual: int) -> int:
    """Return how many examples to draw where these are usual."""
    return usual * SOAK
