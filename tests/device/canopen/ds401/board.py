"""I/O boards for tests: a dictionary of any CiA 401 objects, and its physical side."""

from __future__ import annotations

from tests.device.canopen.slave_bench import Bus
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.slave import ServiceMaker
from tickrig.device.canopen.stack import make_slave
from tickrig.wire.canopen.datatypes import DataType, Value
from tickrig.wire.canopen.eds.object_table import (
    RWRW,
    CommunicationProfile,
    ObjectTable,
    add_communication,
)
from tickrig.wire.canopen.pdo import PdoDescription

Row = tuple[int, int, DataType, Value]
"""Index, number of elements, data type, default."""

BOOL = DataType.BOOLEAN
U8, U16, U32 = DataType.UNSIGNED8, DataType.UNSIGNED16, DataType.UNSIGNED32
I8, I16, I32 = DataType.INTEGER8, DataType.INTEGER16, DataType.INTEGER32
REAL = DataType.REAL32

NODE_ID = 5


def make_dictionary(rows: list[Row], sent: tuple[int, ...] = ()) -> Dictionary:
    """Make a dictionary; TPDO 1 carries what is `sent`."""
    objects = ObjectTable()
    profile = CommunicationProfile(
        device_type=0x000F_0191,
        name="board",
        hardware="",
        software="",
        product_code=0,
        rpdos=(),
        tpdos=(PdoDescription(0x180, sent),),
    )
    add_communication(objects, profile)
    for index, count, kind, default in rows:
        objects.array(index, f"{index:04X}h", count, kind, RWRW, default)
    return Dictionary(objects, objects.objects)


class Board(Bus):
    """A board after boot."""

    def __init__(
        self, rows: list[Row], sent: tuple[int, ...] = (), make: ServiceMaker = Ds401
    ) -> None:
        super().__init__(make_slave(make_dictionary(rows, sent), NODE_ID, application=make))
        self.module = Ds401.of(self.slave)
        self.step()

    def start(self) -> None:
        """Enter Operational."""
        self.step("000#0105")

    def write(self, index: int, sub: int, value: Value) -> None:
        """Write as an SDO client would."""
        entry = self.slave.dictionary[index, sub]
        entry.download(entry.data_type.encode(value))

    def read(self, index: int, sub: int) -> Value:
        """Read as an SDO client would."""
        entry = self.slave.dictionary[index, sub]
        return entry.data_type.decode(entry.upload())

    def see(self, index: int, sub: int) -> Value:
        """Look at an object from the inside."""
        return self.slave.dictionary[index, sub].value

    def set(self, **levels: float) -> list[str]:
        """Set physical inputs and run a tick."""
        for name, level in levels.items():
            self.module.inputs.set(name, level)
        return self.step()

    def put(self, name: str) -> float:
        """Return a physical output."""
        return self.module.read(name)
