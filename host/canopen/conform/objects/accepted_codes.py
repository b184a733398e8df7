"""The SDO abort codes that are accepted for each kind of refusal.

Where CiA 301 leaves a choice, the set is that of CiA's own conformance test tool, as its
published log shows it (CCT 3.0.3.10, test cases SDO 03 to SDO 10).
"""

from __future__ import annotations

from typing import Final

READ_ONLY: Final = ("06010002", "06010000", "08000000")
WRITE_ONLY: Final = ("06010001", "06010000", "08000000")
ABSENT_OBJECT: Final = ("06020000",)
ABSENT_SUB: Final = ("06090011",)
TOO_LONG: Final = ("06070012", "06070010", "08000000")
TOO_SHORT: Final = ("06070013", "06070010", "08000000")
TOO_HIGH: Final = ("06090031", "06090030")
TOO_LOW: Final = ("06090032", "06090030")
NO_VALUE_YET: Final = ("08000024", "08000000", "06090011")
"""What is described and has no value: an error that has not been, a domain that is empty."""
