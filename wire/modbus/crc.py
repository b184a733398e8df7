"""CRC of a frame: CRC-16 with polynomial 8005h, reflected, initial value FFFFh.

Source: Modbus over Serial Line 1.02, CRC Checking.

>>> f"{crc16(b'123456789'):04X}"
'4B37'
"""

from __future__ import annotations

from typing import Final

import crcmod

_crc: Final = crcmod.mkCrcFun(0x1_8005, initCrc=0xFFFF, rev=True, xorOut=0)


def crc16(data: bytes) -> int:
    """Return the CRC over address, function code and data."""
    return _crc(data)
