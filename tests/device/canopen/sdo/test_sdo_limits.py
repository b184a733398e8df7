from __future__ import annotations

import pytest

from tests.device.canopen.reference import NODE_ID
from tests.device.canopen.sdo_client import Client
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.sdo import USUAL, SdoLimits, SdoServers
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.canopen.sdo import Abort, DownloadInitiateRequest, Response
from tickrig.wire.canopen.sdo_frame import (
    AbortCode,
    BlockDownloadInitiateRequest,
    BlockEnd,
    BlockEnded,
    BlockSegment,
    crc16,
)

FIRMWARE, TEXT = 0x1F50, 0x2000
BLOCK, SEGMENT = 127, 7
RW = Access.READ | Access.WRITE


def booted(sdo: SdoLimits = USUAL, most: int | None = None) -> Bus:
    """Make a slave with a domain and a string of four bytes."""
    domain = EntryDescription(FIRMWARE, 1, "Program", DataType.DOMAIN, RW)
    if most is not None:
        domain.max_bytes = most
    text = EntryDescription(TEXT, 0, "Text", DataType.VISIBLE_STRING, RW, default="text")
    bus = Bus(make_slave(Dictionary([domain, text]), NODE_ID, sdo=sdo))
    bus.step()
    return bus


def aborted(code: AbortCode, index: int = FIRMWARE, sub: int = 1) -> Abort:
    return Abort(index, sub, code)


def download(bus: Bus, data: bytes, *, size: int | None) -> Response:
    """Write the domain in blocks; return the last answer."""
    client = Client(bus)
    answer = client.ask(BlockDownloadInitiateRequest(FIRMWARE, 1, crc=True, size=size))
    parts = [data[at : at + SEGMENT] for at in range(0, len(data), SEGMENT)]
    for first in range(0, len(parts), BLOCK):
        if isinstance(answer, Abort):
            return answer
        block = parts[first : first + BLOCK]
        segments = [
            BlockSegment(number, part, last=first + number == len(parts))
            for number, part in enumerate(block, 1)
        ]
        answer = client.ask(*segments)
    if isinstance(answer, Abort):
        return answer
    return client.ask(BlockEnd(-len(data) % SEGMENT, crc16(data)))


@pytest.mark.unmeasured
@pytest.mark.parametrize("told", [True, False])
def test_a_firmware_goes_into_a_domain(told: bool) -> None:
    bus, firmware = booted(), bytes(range(256)) * 257  # more than 64 KiB
    assert download(bus, firmware, size=len(firmware) if told else None) == BlockEnded()
    assert bus.slave.dictionary[FIRMWARE, 1].data == firmware


def test_the_limit_of_a_domain_is_that_of_its_description() -> None:
    bus = booted(most=1_000)
    assert download(bus, bytes(1_000), size=1_000) == BlockEnded()
    assert download(bus, bytes(1_001), size=1_001) == aborted(AbortCode.TOO_LONG)
    assert download(bus, bytes(2_000), size=None) == aborted(AbortCode.TOO_LONG)


def test_what_all_strings_and_domains_hold_is_bounded() -> None:
    bus = booted(SdoLimits(memory_bytes=1_004))
    assert download(bus, bytes(1_000), size=1_000) == BlockEnded()
    assert download(bus, bytes(1_000), size=None) == BlockEnded()
    assert download(bus, bytes(1_001), size=1_001) == aborted(AbortCode.OUT_OF_MEMORY)
    assert download(bus, bytes(2_000), size=None) == aborted(AbortCode.OUT_OF_MEMORY)
    assert Client(bus).ask(DownloadInitiateRequest(TEXT, 0, size=5)) == aborted(
        AbortCode.OUT_OF_MEMORY, TEXT, 0
    )


def test_a_silent_client_is_waited_for_as_long_as_was_said() -> None:
    bus = booted(SdoLimits(timeout_us=20_000))
    bus.step("605#2100200005000000")
    assert bus.run(19) == []
    assert bus.run(1) == ["585#8000200000000405"]


def test_limits_may_be_changed_before_a_transfer() -> None:
    bus = booted()
    servers = SdoServers.of(bus.slave)
    assert servers.limits == USUAL
    servers.limit(SdoLimits(timeout_us=20_000))
    assert servers.limits.timeout_us == 20_000
    bus.step("605#2100200005000000")
    assert bus.run(19) == []
    assert bus.run(1) == ["585#8000200000000405"]


@pytest.mark.parametrize(
    ("wrong", "reason"),
    [({"timeout_us": 0}, "less than 1 us"), ({"memory_bytes": -1}, "less than 0")],
)
def test_limits_that_cannot_be_are_refused(wrong: dict[str, int], reason: str) -> None:
    with pytest.raises(ValueError, match=reason):
        SdoLimits(**wrong)


def test_all_strings_and_domains_may_hold_64_mib_unless_told_otherwise() -> None:
    bus = booted()
    client = Client(bus)
    left = 64 * 1024 * 1024 - len("text")
    refused = client.ask(BlockDownloadInitiateRequest(FIRMWARE, 1, crc=True, size=left + 1))
    assert refused == aborted(AbortCode.OUT_OF_MEMORY)
    taken = client.ask(BlockDownloadInitiateRequest(FIRMWARE, 1, crc=True, size=left))
    assert not isinstance(taken, Abort)


def test_the_shortest_time_out_is_1_us_and_the_smallest_memory_nothing() -> None:
    limits = SdoLimits(timeout_us=1, memory_bytes=0)
    assert (limits.timeout_us, limits.memory_bytes) == (1, 0)
