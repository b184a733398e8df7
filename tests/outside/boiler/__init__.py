"""Hosts of a boiler room: a kettle on a serial line, a stirrer on CAN.

`MISTAKES` are those that are commonly made; the environment variable `BOILER_MISTAKE` plants one.
"""

from __future__ import annotations

import os

MISTAKES = (
    "no time-out",
    "toggle ignored",
    "EMCY not handled",
    "restart race",
    "wrong COB-ID",
    "boot-up lost",
)


def planted(mistake: str) -> bool:
    """Say whether a mistake is planted."""
    assert mistake in MISTAKES
    return os.environ.get("BOILER_MISTAKE") == mistake
