"""Status codes of replies (SCIP 2.0, sensor commands and response to invalid commands)."""

from __future__ import annotations

from typing import Final

OK: Final = "00"
DATA: Final = "99"
"""Behind the echo of a scan that was asked for with MD or MS."""

REPEATED: Final = "0B"
TOO_SHORT: Final = "0C"
TOO_LONG: Final = "0D"
UNKNOWN: Final = "0E"
STRING_TOO_LONG: Final = "0G"
STRING_LETTERS: Final = "0H"

LASER_OFF: Final = "10"
LASER_TROUBLE: Final = "50"
MOTOR_TROUBLE: Final = "51"
"""50..97 are hardware trouble; which is which is ours."""
