"""A slave with R1 and its PDOs, SYNC and NMT alone, and a service that notes EMCYs."""

from __future__ import annotations

from collections.abc import Iterable

from tests.device.canopen.reference import NODE_ID, U8, U32, U64, make_dictionary
from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.dictionary import Dictionary, SdoAbort
from tickrig.device.canopen.nmt import NmtSlave
from tickrig.device.canopen.pdo.rpdo import PdoConsumer
from tickrig.device.canopen.pdo.tpdo import PdoProducer
from tickrig.device.canopen.slave import CanopenSlave, Service
from tickrig.device.canopen.sync import Sync
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription
from tickrig.wire.canopen.sdo_frame import AbortCode

RW = Access.READ | Access.WRITE
OFF = 0x8000_0000
NO_RTR = 0x4000_0000


class Emergencies(Service):
    """Notes what the other services report."""

    def start(self) -> None:
        self.notes: list[str] = []

    def emergency(self, code: int, register: int, text: bytes) -> None:
        self.notes.append(f"{code:04X} {register:02X} {text.hex()}")

    def emergency_clear(self, code: int, text: bytes | None) -> None:
        self.notes.append(f"{code:04X} gone" + (f" {text.hex()}" if text else ""))


class PdoBench(Bus):
    """A slave that has booted; objects are written as by SDO, but without frames."""

    def __init__(self, *more: EntryDescription, without: Iterable[int] = ()) -> None:
        left_out = set(without)
        kept = [entry for entry in make_dictionary().description if entry.index not in left_out]
        services = (NmtSlave, Sync, PdoConsumer, PdoProducer, Emergencies)
        super().__init__(CanopenSlave(Dictionary([*kept, *more]), NODE_ID, services))
        assert self.step() == ["705#00"]

    def write(self, index: int, sub: int, value: int) -> AbortCode | None:
        """Write an object over the bus; return why it was refused."""
        entry = self.slave.dictionary[index, sub]
        try:
            entry.download(entry.data_type.encode(value))
        except SdoAbort as abort:
            return abort.code
        return None

    def must_write(self, *writes: tuple[int, int, int]) -> None:
        """Write objects that must be taken."""
        for index, sub, value in writes:
            assert self.write(index, sub, value) is None, f"{index:04X}h:{sub:02X}"

    def map(self, index: int, *mapped: int) -> None:
        """Follow the re-mapping procedure; the PDO must be switched off."""
        self.must_write((index, 0, 0))
        self.must_write(*((index, sub, value) for sub, value in enumerate(mapped, 1)))
        self.must_write((index, 0, len(mapped)))

    def set_tpdo1(self, kind: int, *more: tuple[int, int], cob_id: int = NO_RTR | 0x185) -> None:
        """Give TPDO1 a transmission type and other parameters, switched off meanwhile."""
        self.must_write((0x1800, 1, OFF | cob_id), (0x1800, 2, kind))
        self.must_write(*((0x1800, sub, value) for sub, value in more))
        self.must_write((0x1800, 1, cob_id))

    def set_rpdo1(self, kind: int, *more: tuple[int, int]) -> None:
        """Give RPDO1 a transmission type and other parameters, switched off meanwhile."""
        self.must_write((0x1400, 1, OFF | 0x205), (0x1400, 2, kind))
        self.must_write(*((0x1400, sub, value) for sub, value in more))
        self.must_write((0x1400, 1, 0x205))

    def silence_tpdo2(self) -> None:
        """Switch off the TPDO that R1 has and a test does not want."""
        self.must_write((0x1801, 1, OFF | NO_RTR | 0x285))

    def operational(self) -> list[str]:
        """Start the node."""
        return self.step("000#0105")

    def value(self, index: int, sub: int = 0) -> int:
        """Return the present value of an integer."""
        return self.slave.dictionary[index, sub].number

    def set(self, index: int, sub: int, value: int) -> None:
        """Change an object from the inside."""
        self.slave.dictionary[index, sub].value = value

    @property
    def emergencies(self) -> list[str]:
        """Return what was reported, and forget it."""
        service = Emergencies.of(self.slave)
        notes, service.notes = service.notes, []
        return notes


def u8(index: int, sub: int, value: int = 0, access: Access = RW) -> EntryDescription:
    """Make an entry of one byte."""
    return EntryDescription(index, sub, "u8", U8, access, default=value)


def u32(index: int, sub: int, value: int = 0) -> EntryDescription:
    """Make an entry of four bytes."""
    return EntryDescription(index, sub, "u32", U32, RW, default=value)


def u64(index: int, sub: int, value: int = 0) -> EntryDescription:
    """Make an entry of eight bytes."""
    return EntryDescription(index, sub, "u64", U64, RW, default=value)
