"""The macros of the conformance checks: whole transfers, SYNC periods, fastscan."""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Callable, Iterator
from typing import Final

from tests.device.canopen.runner import Runner

REQUEST: Final = 0x605
RESPONSE: Final = 0x585
WITHIN_MS: Final = 100


def pattern(size: int) -> bytes:
    """Return the bytes of a transfer: (7k + n) mod 256, 1 for 0."""
    return bytes((7 * k + size) % 256 or 1 for k in range(size))


def sync(run: Runner, count: int) -> None:
    """Send SYNCs 1 ms apart."""
    for _ in range(count):
        run.send("080#")
        run.flush()


def sync_period(run: Runner, period: int) -> None:
    """SYNC until the first TPDO, then one TPDO must come with every n-th SYNC."""
    seen = run.unread(0x185)
    for _ in range(period):
        sync(run, 1)
        run.wait(1)
        if seen:
            break
    assert len(seen) == 1, f"{len(seen)} TPDOs within {period} SYNC"
    seen.clear()
    for number in range(1, 3 * period + 1):
        sync(run, 1)
        run.wait(1)
        want = number % period == 0
        assert len(seen) == want, f"{len(seen)} TPDOs at SYNC {number} after the first"
        seen.clear()


def download_segmented(run: Runner, index: int, sub: int, size: int) -> None:
    """Write the pattern in segments."""
    _request(run, bytes([0x21]) + _multiplexer(index, sub) + size.to_bytes(4, "little"))
    _response(run, bytes([0x60]) + _multiplexer(index, sub) + bytes(4))
    data = pattern(size)
    for number, start in enumerate(range(0, size, 7)):
        part, toggle = data[start : start + 7], (number & 1) << 4
        last = start + 7 >= size
        _request(run, bytes([toggle | (7 - len(part)) << 1 | last]) + part.ljust(7, b"\0"))
        _response(run, bytes([0x20 | toggle]) + bytes(7))


def upload_segmented(run: Runner, index: int, sub: int, size: int) -> None:
    """Read in segments; it must be the pattern."""
    _request(run, bytes([0x40]) + _multiplexer(index, sub) + bytes(4))
    _response(run, bytes([0x41]) + _multiplexer(index, sub) + size.to_bytes(4, "little"))
    data, toggle, last = b"", 0, False
    while not last:
        _request(run, bytes([0x60 | toggle]) + bytes(7))
        segment = _any_response(run)
        assert segment[0] & 0xF0 == toggle, f"segment {segment.hex()}, toggle {toggle:02X}"
        last = bool(segment[0] & 1)
        data += segment[1 : 8 - (segment[0] >> 1 & 7)]
        toggle ^= 0x10
    assert data == pattern(size), f"{len(data)} bytes that are not the pattern"


def download_block(run: Runner, index: int, sub: int, size: int) -> None:
    """Write the pattern in blocks with CRC."""
    _request(run, bytes([0xC6]) + _multiplexer(index, sub) + size.to_bytes(4, "little"))
    answer = _any_response(run)
    assert answer[:4] == bytes([0xA4]) + _multiplexer(index, sub), answer.hex()
    data, done, block = pattern(size), 0, answer[4]
    while done < size:
        parts = list(_block(data[done:], block))
        for part in parts:
            _request(run, part)
        answer = _any_response(run)
        assert answer[0] == 0xA2, answer.hex()
        assert 1 <= answer[1] <= len(parts), answer.hex()
        done, block = done + 7 * answer[1], answer[2]
    end = 0xC1 | (-size % 7) << 2
    _request(run, bytes([end]) + crc_hqx(data, 0).to_bytes(2, "little") + bytes(5))
    _response(run, bytes([0xA1]) + bytes(7))


def upload_block(run: Runner, index: int, sub: int, size: int, block: int) -> None:
    """Read in blocks with CRC; it must be the pattern."""
    _request(run, bytes([0xA4]) + _multiplexer(index, sub) + bytes([block, 0, 0, 0]))
    _response(run, bytes([0xC6]) + _multiplexer(index, sub) + size.to_bytes(4, "little"))
    _request(run, bytes([0xA3]) + bytes(7))
    data, number, last = b"", 0, False
    while not last:
        segment = _any_response(run)
        number += 1
        assert segment[0] & 0x7F == number, f"segment {segment.hex()}, want number {number}"
        last = bool(segment[0] & 0x80)
        data += segment[1:]
        if last or number == block:
            _request(run, bytes([0xA2, number, block]) + bytes(5))
            number = 0
    unused = -size % 7
    data = data[: len(data) - unused]
    assert data == pattern(size), f"{len(data)} bytes that are not the pattern"
    _response(run, bytes([0xC1 | unused << 2]) + crc_hqx(data, 0).to_bytes(2, "little") + bytes(5))
    _request(run, bytes([0xA1]) + bytes(7))


def fastscan(run: Runner, *address: int) -> None:
    """Find the LSS address bit by bit (CiA 305, LSS fastscan)."""
    assert _scan(run, 0, 0x80, 0, 0), "no answer to the start of the fastscan"
    for sub, wanted in enumerate(address):
        found = 0
        for bit in range(31, -1, -1):
            if not _scan(run, found, bit, sub, sub):
                found |= 1 << bit
        assert found == wanted, f"found {found:X} as LSS sub {sub}, want {wanted:X}"
        assert _scan(run, found, 0, sub, (sub + 1) % 4), f"LSS sub {sub} is not confirmed"


def _scan(run: Runner, number: int, bit: int, sub: int, following: int) -> bool:
    run.send("7E5#51" + (number.to_bytes(4, "little") + bytes([bit, sub, following])).hex())
    run.wait(5)
    answers = run.unread(0x7E4)
    answered = bool(answers)
    assert list(answers) in ([], ["7E4#4F00000000000000"]), list(answers)
    answers.clear()
    return answered


def _block(data: bytes, most: int) -> Iterator[bytes]:
    for number, start in enumerate(range(0, min(len(data), 7 * most), 7), 1):
        last = 0x80 if start + 7 >= len(data) else 0
        yield bytes([number | last]) + data[start : start + 7].ljust(7, b"\0")


def _multiplexer(index: int, sub: int) -> bytes:
    return index.to_bytes(2, "little") + bytes([sub])


def _request(run: Runner, data: bytes) -> None:
    run.send(f"{REQUEST:03X}#{data.hex()}")


def _response(run: Runner, data: bytes) -> None:
    run.expect([f"{RESPONSE:03X}#{data.hex().upper()}"], WITHIN_MS)


def _any_response(run: Runner) -> bytes:
    return bytes.fromhex(run.expect([f"{RESPONSE:03X}#.*"], WITHIN_MS)[4:])


MACROS: Final[dict[str, Callable[..., None]]] = {
    "sync": sync,
    "syncperiod": sync_period,
    "segdn": download_segmented,
    "segup": upload_segmented,
    "blkdn": download_block,
    "blkup": upload_block,
    "fastscan": fastscan,
}
