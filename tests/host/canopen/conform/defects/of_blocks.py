"""Defects of SDO block transfer."""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Iterable
from typing import Final

from tests.host.canopen.conform.defects.defect import Bends, Defect, hears, says, together
from tickrig.device.canopen.slave import CanopenSlave


class Blocks:
    """Follows the blocks of a download, and makes good what is wrong in them."""

    def __init__(self, *, crc: bool = False, sequence: bool = False) -> None:
        self._crc, self._sequence = crc, sequence
        self._open, self._count, self._data = False, 0, b""

    def __call__(self, slave: CanopenSlave) -> Bends:
        return Bends(self.hear, self.say)

    def hear(self, text: str) -> Iterable[str]:
        if not text.startswith("605#") or not self._open:
            return (text,)
        data = bytes.fromhex(text[4:])
        if data[0] & 0xE1 == 0xC1 and not self._count and self._crc:
            whole = self._data[: len(self._data) - (data[0] >> 2 & 7)]
            self._open = False
            return (f"605#{data[0]:02X}{crc_hqx(whole, 0).to_bytes(2, 'little').hex()}0000000000",)
        if data[0] == 0x80:
            self._open = False
            return (text,)
        self._count += 1
        if not self._sequence:
            if data[0] & 0x7F == self._count:
                self._data += data[1:]
            return (text,)
        return (f"605#{data[0] & 0x80 | self._count:02X}{text[6:]}",)

    def say(self, text: str) -> Iterable[str]:
        if text[:5] == "585#A" and text[5] in "04":
            self._open, self._count, self._data = True, 0, b""
        elif text[:6] == "585#A2":
            self._count = 0
        elif text[:6] in ("585#A1", "585#80"):
            self._open = False
        return (text,)


DEFECTS: Final = (
    Defect("CRC unchecked", ("BD-04",), Blocks(crc=True)),
    Defect(
        "wrong CRC", ("BU-01",), says("585#([CD][159D])(....)0000000000", r"585#\1ABCD0000000000")
    ),
    Defect(
        "CRC without being asked",
        ("BU-02",),
        says("585#([CD][159D])00000000000000", r"585#\g<1>12340000000000"),
    ),
    Defect("block sequence error ignored", ("BD-05", "BD-06"), Blocks(sequence=True)),
    Defect("no block download without CRC", ("BD-02",), hears("605#C2(.*)", r"605#E0\1")),
    Defect("no block download", ("BD-01", "BD-03"), hears("605#C[26](.*)", r"605#E0\1")),
    Defect("abort in a block is ignored", ("BD-09", "BU-12"), hears("605#80.*")),
    Defect(
        "block size 0 is taken", ("BU-04",), hears("605#(A[04])(......)00(.*)", r"605#\1\g<2>7F\3")
    ),
    Defect(
        "block size 128 is taken",
        ("BU-05",),
        hears("605#(A[04])(......)80(.*)", r"605#\1\g<2>7F\3"),
    ),
    Defect(
        "block size 1 is not kept",
        ("BU-03",),
        hears("605#(A[04])(......)01(.*)", r"605#\1\g<2>7F\3"),
    ),
    Defect("unused bytes of a block", ("BU-01", "BD-12"), says("585#(C|D)[159D](.*)", r"585#C1\2")),
    Defect(
        "acknowledged segments are not looked at",
        ("BU-06", "BU-07"),
        hears("605#A2..(.*)", r"605#A203\1"),
    ),
    Defect(
        "block size of an acknowledgement is ignored",
        ("BU-09",),
        hears("605#A2(..)..(.*)", r"605#A2\g<1>01\2"),
    ),
    Defect("lost segments are not asked for", ("BD-05",), says("585#A201(.*)", r"585#A203\1")),
    Defect(
        "4 bytes are no block", ("BU-10",), hears("605#A[04]001000(?!01)(.*)", r"605#E0001000\1")
    ),
    Defect(
        *("block download of read-only is confirmed", ("BD-07",)),
        hears("605#(C[26])001000(.*)", r"605#\g<1>022000\2"),
    ),
    Defect(
        *("block download of an absent object is confirmed", ("BD-08",)),
        hears("605#(C[26])(?!07|17|08)....(.*)", r"605#\g<1>0220\2"),
    ),
    Defect(
        "fewer bytes than a block announces",
        ("BD-11",),
        together(hears("605#C6(.*)", r"605#C0\1"), says("585#A0(.*)", r"585#A4\1")),
    ),
    Defect(
        "threshold of a block upload is refused",
        ("BU-08",),
        hears("605#A[04](.{8})(?!00)(.*)", r"605#E0\1\2"),
    ),
)
