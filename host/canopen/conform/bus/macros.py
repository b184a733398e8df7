"""Macros of the checks, such as whole transfers, SYNC periods, re-mapping and fastscan."""

from __future__ import annotations

from binascii import crc_hqx
from collections.abc import Callable, Iterator, Sized
from typing import Final

from tickrig.host.canopen.conform.bus.exchange import Disturbed, NotAllowed, StepFailed
from tickrig.host.canopen.conform.bus.frame_pattern import matches
from tickrig.host.canopen.conform.bus.sdo import ABORTED, SdoFrames, multiplexer
from tickrig.host.canopen.conform.check import ANSWER_MS, Address
from tickrig.host.canopen.conform.notation import TO_MAPPING
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.sdo_frame import SEGMENT_BYTES, AbortCode

# A drive that moves from where it is to its target position.

_POLL_MS: Final = 20
_NOISE: Final = 1
"""Position tolerance of a drive that stands still, in counts."""
_POSITION_BYTES: Final = 4
"""Size of a position, which is an INTEGER32 (CiA 402-2, 607Ah and 6064h)."""


def follow(  # noqa: PLR0913, PLR0917 - the words of the macro
    sdo: SdoFrames, target: Address, actual: Address, step: str, tolerance: str, within_ms: str
) -> None:
    """Move a drive a small distance from its position, and wait until it reaches the target.

    Args:
        sdo: SDO client of the drive.
        target: target position (object 607Ah).
        actual: position actual value (object 6064h).
        step: distance of the target from the actual position, in counts. It is small, so that no
            drive jumps.
        tolerance: allowed distance from the target at the end, in counts.
        within_ms: time limit of the move in milliseconds. The drive must also come to rest within
            this time before the move.

    Raises:
        StepFailed: the drive does not reach the target in time.
        Disturbed: the drive does not come to rest before the move, because something else moves it.
    """
    wanted = _rest(sdo, actual, int(within_ms)) + int(step)
    sdo.write(target, (wanted & 0xFFFF_FFFF).to_bytes(_POSITION_BYTES, "little"))
    for waited_ms in range(0, int(within_ms) + 1, _POLL_MS):
        got = _position(sdo, actual)
        if abs(got - wanted) <= int(tolerance):
            return
        if waited_ms + _POLL_MS <= int(within_ms):
            sdo.exchange.wait(_POLL_MS)
    raise StepFailed(f"at {got} after {within_ms} ms, want {wanted}, {tolerance} off at most")


def _rest(sdo: SdoFrames, actual: Address, within_ms: int) -> int:
    """Wait until the drive stands still. Return the position of the drive."""
    before = _position(sdo, actual)
    for _ in range(0, within_ms, _POLL_MS):
        sdo.exchange.wait(_POLL_MS)
        now = _position(sdo, actual)
        if abs(now - before) <= _NOISE:
            return now
        before = now
    raise Disturbed(f"the drive does not come to rest within {within_ms} ms")


def _position(sdo: SdoFrames, at: Address) -> int:
    return int.from_bytes(sdo.read_data(at, _POSITION_BYTES), "little", signed=True)


_MOST_BYTES: Final = 20_000
"""Number of bytes above which a transfer fails, so that an endless transfer is detected."""

_STATE_MS: Final = 20
"""Time after an NMT command until a node is in its new state."""

_TOO_LONG: Final = ("12000706", "10000706", "05000405")
"""Abort codes that refuse a download that is longer than the object can hold."""

_SCAN_MS: Final = 10
_FOUND: Final = "7E4#4F00000000000000"
_STORE_LSS: Final = "7E5#1700000000000000"
_LSS_STORED: Final = "7E4#1700000000000000"
_LSS_STORES_NOTHING: Final = "7E4#1701000000000000"
"""Error code 1 of "store configuration" (CiA 305): the device does not support this command."""


def _pattern(size: int) -> bytes:
    """Return the bytes of a transfer: (7k + n) mod 256, with 1 in place of 0."""
    return bytes((7 * k + size) % 256 or 1 for k in range(size))


def sync(sdo: SdoFrames, can_id: str, count: str) -> None:
    """Send SYNCs 1 ms apart."""
    for _ in range(int(count)):
        sdo.exchange.send(CanFrame.parse(f"{can_id}#"))
        sdo.exchange.wait(1)


def _sync_period(sdo: SdoFrames, can_id: str, tpdo: str, period: str) -> None:
    """Send SYNCs until the first TPDO. After that, a TPDO must come with every n-th SYNC."""
    every, seen = int(period), sdo.exchange.unread(tpdo)
    for number in range(1, every + 1):
        _sync_and_wait(sdo, can_id)
        if not seen and (every <= _FEW or number == every):
            _wait_for(sdo, seen)
        if seen:
            break
    if len(seen) != 1:
        raise StepFailed(f"{len(seen)} x {tpdo} within {every} SYNC, want 1")
    seen.clear()
    for number in range(1, 3 * every + 1):
        _sync_and_wait(sdo, can_id)
        want = number % every == 0
        if want:
            _wait_for(sdo, seen)
        if len(seen) != want:
            raise StepFailed(
                f"{len(seen)} x {tpdo} at SYNC {number} after the first, want {want:d}"
            )
        seen.clear()


def _sync_and_wait(sdo: SdoFrames, can_id: str) -> None:
    sdo.exchange.send(CanFrame.parse(f"{can_id}#"))
    sdo.exchange.wait(_PDO_MS)


def _wait_for(sdo: SdoFrames, seen: Sized) -> None:
    """Wait for a late TPDO. CiA 301 does not define how soon a TPDO must follow the SYNC."""
    for _ in range(_LATE_MS // _PDO_MS):
        if not seen:
            sdo.exchange.wait(_PDO_MS)


_PDO_MS: Final = 5
"""Time to wait for a TPDO after a SYNC that need not trigger a TPDO."""
_LATE_MS: Final = 100
"""Time to wait for a TPDO after a SYNC that must trigger a TPDO."""
_FEW: Final = 10
"""Number of SYNCs after which to wait for a TPDO. The SYNC that triggers it is unknown."""


def _download_segmented(sdo: SdoFrames, at: Address, size: str) -> None:
    """Write the test pattern in segments."""
    data = _pattern(int(size))
    sdo.say(bytes([0x21, *_mux(at)]) + len(data).to_bytes(4, "little"))
    sdo.answer(f"60{multiplexer(at)}00000000")
    sdo.download_segments(data)


def room(sdo: SdoFrames, at: Address, size: str) -> None:
    """Start and abort an SDO download, to find out whether an object can hold `size` bytes.

    This is needed because an EDS does not state the maximum length of a string.

    Raises:
        NotAllowed: the node answers that the object is too short.
    """
    sdo.say(bytes([0x21, *_mux(at)]) + int(size).to_bytes(4, "little"))
    mux = multiplexer(at)
    answer = sdo.answer(f"60{mux}00000000", *(f"80{mux}{code}" for code in _TOO_LONG))
    if answer[0] == ABORTED:
        raise NotAllowed(f"{at[0]:04X}h:{at[1]:02X} holds less than {size} bytes")
    sdo.say(bytes([ABORTED, *_mux(at)]) + AbortCode.GENERAL.to_bytes(4, "little"))


def _upload_pattern(sdo: SdoFrames, at: Address, size: str) -> None:
    """Read an object in segments. The data must be the test pattern."""
    _compare(_upload_segmented(sdo, at), _pattern(int(size)))


def _upload_segmented(sdo: SdoFrames, at: Address) -> bytes:
    """Read an object in segments with alternating toggle bit. Return the data."""
    sdo.say(bytes([0x40, *_mux(at), *bytes(4)]))
    size = int.from_bytes(sdo.answer(f"41{multiplexer(at)}........")[4:], "little")
    data, toggle, last = b"", 0, False
    while not last:
        sdo.say(bytes([0x60 | toggle, *bytes(7)]))
        segment = sdo.answer(f"{toggle >> 4:X}[0-9A-F]..............")
        last = bool(segment[0] & 1)
        data += segment[1 : 8 - (segment[0] >> 1 & 7)]
        toggle ^= 0x10
        if len(data) > _MOST_BYTES:
            raise StepFailed(f"{len(data)} bytes, without a last segment")
    if len(data) != size:
        raise StepFailed(f"{len(data)} bytes came, {size} were indicated")
    return data


def _download_block(sdo: SdoFrames, at: Address, size: str) -> None:
    """Write the test pattern in blocks with CRC."""
    data, done = _pattern(int(size)), 0
    sdo.say(bytes([0xC6, *_mux(at)]) + len(data).to_bytes(4, "little"))
    block = sdo.answer(f"A[04]{multiplexer(at)}..000000")[4]
    while done < len(data):
        if not 1 <= block <= 127:
            raise StepFailed(f"block size {block}, want 1..127")
        parts = list(_block(data[done:], block))
        for part in parts:
            sdo.say(part)
        answer = sdo.answer("A2....0000000000")
        if not 1 <= answer[1] <= len(parts):
            raise StepFailed(f"segment {answer[1]} acknowledged of {len(parts)}")
        done, block = done + SEGMENT_BYTES * answer[1], answer[2]
    end = 0xC1 | (-len(data) % SEGMENT_BYTES) << 2
    sdo.say(bytes([end]) + crc_hqx(data, 0).to_bytes(2, "little") + bytes(5))
    sdo.answer("A100000000000000")


def _upload_block_pattern(sdo: SdoFrames, at: Address, size: str, block: str) -> None:
    """Read an object in blocks with CRC. The data must be the test pattern."""
    _compare(_upload_block(sdo, at, block), _pattern(int(size)))


def _upload_same(sdo: SdoFrames, at: Address, block: str = "127", crc: str = "") -> None:
    """Read an object in blocks and in segments. The data must be the same."""
    _compare(_upload_block(sdo, at, block, crc), _upload_segmented(sdo, at))


def _upload_block(sdo: SdoFrames, at: Address, block: str, crc: str = "") -> bytes:
    """Read an object in blocks. Return the data.

    Args:
        sdo: frames to and from the SDO server.
        at: index and sub-index of the object.
        block: number of segments of a block. `1,2` gives the size of the first block and of each
            later block.
        crc: `without-crc`, or an empty text for a transfer with CRC.
    """
    most, following = int(block.split(",", maxsplit=1)[0]), int(block.rsplit(",", maxsplit=1)[-1])
    sdo.say(bytes([0xA0 if crc else 0xA4, *_mux(at), most, 0, 0, 0]))
    answer = sdo.answer(f"C[0-7]{multiplexer(at)}........")
    checked = bool(answer[0] & 4) and not crc
    size = int.from_bytes(answer[4:], "little")
    sdo.say(bytes([0xA3, *bytes(7)]))
    data, number, last = b"", 0, False
    while not last:
        number += 1
        segment = sdo.answer(f"[{number >> 4:X}{number >> 4 | 8:X}]{number & 15:X}..............")
        last = bool(segment[0] & 0x80)
        data += segment[1:]
        if len(data) > _MOST_BYTES:
            raise StepFailed(f"{len(data)} bytes, without a last segment")
        if last or number == most:
            sdo.say(bytes([0xA2, number, following, *bytes(5)]))
            number, most = 0, following
    end = sdo.answer("[CD][159D]....0000000000")
    data = data[: len(data) - (end[0] >> 2 & 7)]
    wanted = crc_hqx(data, 0) if checked else 0
    if int.from_bytes(end[1:3], "little") != wanted:
        raise StepFailed(f"CRC {end[2]:02X}{end[1]:02X}h, want {wanted:04X}h")
    if answer[0] & 2 and len(data) != size:
        raise StepFailed(f"{len(data)} bytes came, {size} were indicated")
    sdo.say(bytes([0xA1, *bytes(7)]))
    return data


def _remap(sdo: SdoFrames, pdo: Address, on: str, kind: str, *entries: str) -> None:
    """Map objects by the procedure of CiA 301. Set transmission type and COB-ID of the PDO."""
    head, body, cob_id = pdo[0], pdo[0] + TO_MAPPING, bytes.fromhex(on)
    off = cob_id[:3] + bytes([cob_id[3] | 0x80])
    sdo.write((head, 1), off)
    sdo.write((body, 0), b"\0")
    for sub, entry in enumerate(entries, 1):
        sdo.write((body, sub), bytes.fromhex(entry))
    sdo.write((body, 0), bytes([len(entries)]))
    sdo.write((head, 2), bytes.fromhex(kind))
    sdo.write((head, 1), cob_id)


def enable(sdo: SdoFrames, pdo: Address, on: str, *entries: str) -> None:
    """Enable a PDO by its COB-ID. If the PDO has no mapping, first map the given objects.

    A node may refuse to enable a PDO without a mapping.
    """
    head, body, cob_id = pdo[0], pdo[0] + TO_MAPPING, bytes.fromhex(on)
    sdo.write((head, 1), cob_id[:3] + bytes([cob_id[3] | 0x80]))
    if not sdo.read_data((body, 0), 1)[0]:
        for sub, entry in enumerate(entries, 1):
            sdo.write((body, sub), bytes.fromhex(entry))
        sdo.write((body, 0), bytes([len(entries)]))
    sdo.write((head, 1), cob_id)


def _refuse_segments(sdo: SdoFrames, at: Address, size: str, *codes: str) -> None:
    """Write `size` bytes in segments. The node must refuse the transfer at once or at the end."""
    mux = multiplexer(at)
    aborts = [f"80{mux}{bytes.fromhex(code)[::-1].hex().upper()}" for code in codes]
    sdo.say(bytes([0x21, *_mux(at)]) + int(size).to_bytes(4, "little"))
    if sdo.answer(f"60{mux}00000000", *aborts)[0] == ABORTED:
        return
    data = _pattern(int(size))
    sdo.say(bytes([(SEGMENT_BYTES - len(data)) << 1 | 1]) + data.ljust(SEGMENT_BYTES, b"\0"))
    sdo.answer(*aborts)


def guard(sdo: SdoFrames, can_id: str, *words: str) -> None:
    """Request node guarding several times, and check the reported NMT states and the toggle bit.

    Args:
        sdo: SDO frames of the node, which give access to the bus.
        can_id: CAN-ID of the node's error control messages.
        words: expected NMT states in hex, one per request, such as `7F`. In the first answer, the
            toggle bit may be 0 or 1. In each later answer, the toggle bit must have changed. If a
            state has the prefix `=`, as in `=7F`, the toggle bit must be 0 in the answer to its
            request. A word that contains # is not a state but a frame, which is sent before the
            next request.
    """
    toggle: int | None = None
    for word in words:
        if "#" in word:
            sdo.exchange.send(CanFrame.parse(word))
            sdo.exchange.wait(_STATE_MS)
            continue
        sdo.exchange.forget(can_id)
        sdo.exchange.send(CanFrame.parse(f"{can_id}#R1"))
        state = int(word.removeprefix("="), 16)
        wanted = (state, state | 0x80) if toggle is None else (state | toggle ^ 0x80,)
        wanted = (state,) if word.startswith("=") else wanted
        got = sdo.exchange.expect([f"{can_id}#{number:02X}" for number in wanted], ANSWER_MS)
        toggle = int(got[-2:], 16) & 0x80


def fastscan(sdo: SdoFrames, *address: str) -> None:
    """Find the LSS address bit by bit (CiA 305, LSS fastscan)."""
    if not _scan(sdo, 0, 0x80, 0, 0):
        raise StepFailed("no answer to the start of the fastscan")
    for sub, wanted in enumerate(address):
        found = 0
        for bit in range(31, -1, -1):
            if not _scan(sdo, found, bit, sub, sub):
                found |= 1 << bit
        number = int.from_bytes(bytes.fromhex(wanted), "little")
        if found != number:
            raise StepFailed(f"found {found:X}h as LSS sub {sub}, want {number:X}h")
        if not _scan(sdo, found, 0, sub, (sub + 1) % 4):
            raise StepFailed(f"LSS sub {sub} is not confirmed")


def _scan(sdo: SdoFrames, number: int, bit: int, sub: int, following: int) -> bool:
    text = "7E5#51" + (number.to_bytes(4, "little") + bytes([bit, sub, following])).hex()
    sdo.exchange.send(CanFrame.parse(text))
    sdo.exchange.wait(_SCAN_MS)
    answers = sdo.exchange.unread(_FOUND[:3])
    wrong = [frame for _, frame in answers if not matches(_FOUND, str(frame))]
    answered = bool(answers)
    answers.clear()
    if wrong:
        raise StepFailed(f"got {wrong[0]}, want {_FOUND}")
    return answered


def _block(data: bytes, most: int) -> Iterator[bytes]:
    for number, start in enumerate(range(0, min(len(data), SEGMENT_BYTES * most), 7), 1):
        last = 0x80 if start + SEGMENT_BYTES >= len(data) else 0
        part = data[start : start + SEGMENT_BYTES]
        yield bytes([number | last]) + part.ljust(SEGMENT_BYTES, b"\0")


def _mux(at: Address) -> bytes:
    return bytes.fromhex(multiplexer(at))


def _compare(got: bytes, wanted: bytes) -> None:
    if got != wanted:
        raise StepFailed(f"{len(got)} bytes, not the {len(wanted)} that were wanted")


def _lss_store(sdo: SdoFrames) -> None:
    """Store the LSS configuration. Raise NotAllowed if the node answers that it cannot store."""
    sdo.exchange.send(CanFrame.parse(_STORE_LSS))
    if sdo.exchange.expect([_LSS_STORED, _LSS_STORES_NOTHING], ANSWER_MS) == _LSS_STORES_NOTHING:
        raise NotAllowed("the node does not store the LSS configuration: error code 1")


MACROS: Final[dict[str, Callable[..., object]]] = {
    "sync": sync,
    "syncperiod": _sync_period,
    "segdn": _download_segmented,
    "room": room,
    "segup": _upload_pattern,
    "blkdn": _download_block,
    "blkup": _upload_block_pattern,
    "upload": _upload_segmented,
    "blockup": _upload_same,
    "map": _remap,
    "enable": enable,
    "refusesegments": _refuse_segments,
    "fastscan": fastscan,
    "lssstore": _lss_store,
    "guard": guard,
    "follow": follow,
}
