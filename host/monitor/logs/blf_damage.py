"""BLF logs that are damaged: python-can reads one that was cut as far as it goes, in silence.

A BLF log is a header and objects. Most are containers, whose contents, put together,
are the objects of interest; one may lie across two containers.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from typing import BinaryIO, Final

import can

_FILE: Final = struct.Struct("<4sL8xQ8xL")  # signature, sizes of header and file, objects
_OBJECT: Final = struct.Struct("<4sHHLL")  # signature, header, version, size, type
_CONTAINER: Final = struct.Struct("<H6xL4x")  # compression, size of what is in it
_SIGNATURE: Final = b"LOBJ"
_SEARCHED: Final = 8
"""Bytes in which an object begins: behind the padding of the one before."""

_CONTAINER_TYPE: Final = 10
_DEFLATED: Final = 2


class BlfReader(can.BLFReader):
    """python-can's reader, but for objects without a size, of which it never sees the end."""

    def _parse_data(self, data: bytes) -> Iterator[can.Message]:
        _, rest = _count(data)
        at = rest.find(_SIGNATURE, 0, _SEARCHED)
        if at >= 0 and len(rest) >= at + _OBJECT.size:
            size = _OBJECT.unpack_from(rest, at)[3]
            if size < _OBJECT.size:
                raise ValueError(f"it has an object of {size} bytes")
        yield from super()._parse_data(data)


def missing_end(file: BinaryIO) -> str:
    """Say what is missing at the end of a log; empty where nothing is.

    Args:
        file: a log that python-can has read without an error; it is read from its beginning.
    """
    file.seek(0)
    _, header_bytes, _, declared = _FILE.unpack(file.read(_FILE.size))
    file.seek(header_bytes)
    found, held = 0, b""
    for content in _contents(file):
        if content is None:
            return f"it is cut after {found} objects"
        objects, held = _count(held + content)
        found += objects + 1
    if len(held) >= _OBJECT.size:
        return f"it is cut after {found} objects"
    return f"it ends after {found} of {declared} objects" if found < declared else ""


def has_end(file: BinaryIO) -> bool:
    """Say whether whoever wrote a log ended it: only then its header tells the size of the file."""
    _, header_bytes, file_bytes, _ = _FILE.unpack(file.read(_FILE.size))
    return bool(file_bytes != header_bytes)


def _contents(file: BinaryIO) -> Iterator[bytes | None]:
    """Yield what is in each object of the file: of others than containers nothing, None if cut."""
    while head := file.read(_OBJECT.size):
        if len(head) < _OBJECT.size:
            yield None
            return
        _, _, _, size, kind = _OBJECT.unpack(head)
        body = file.read(max(0, size - _OBJECT.size))
        file.read(size % 4)
        if len(body) < size - _OBJECT.size:
            yield None
            return
        yield _content(body) if kind == _CONTAINER_TYPE else b""


def _content(body: bytes) -> bytes | None:
    method, size = _CONTAINER.unpack_from(body)
    if method != _DEFLATED:
        return body[_CONTAINER.size :]
    content = zlib.decompressobj().decompress(body[_CONTAINER.size :])
    return content if len(content) >= size else None


def _count(data: bytes) -> tuple[int, bytes]:
    """Return how many objects are whole, and the bytes behind them."""
    count = at = 0
    last = len(data) - _OBJECT.size
    while 0 <= (begin := data.find(_SIGNATURE, at, at + _SEARCHED)) <= last:
        size = _OBJECT.unpack_from(data, begin)[3]
        if size < _OBJECT.size or begin + size > len(data):
            break
        count, at = count + 1, begin + size
    return count, data[at:]
