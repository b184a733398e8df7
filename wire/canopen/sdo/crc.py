"""CRC of SDO block transfer: CRC-16 with polynomial 1021h and initial value 0 (CiA 301).

>>> f"{crc16(b'123456789'):04X}"
'31C3'
"""

from __future__ import annotations

from typing import Final

import crcmod

_crc: Final = crcmod.mkCrcFun(0x1_1021, initCrc=0, rev=False, xorOut=0)


def crc16(data: bytes) -> int:
    """Return the CRC over the data of a block transfer, without the fill of the last segment."""
    return _crc(data)
