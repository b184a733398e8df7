"""When a master sends the RPDOs of a slave, and what it takes of its TPDOs."""

from __future__ import annotations

import pytest

from tickrig.host.canopen.bus_file.bus_values import BusPdo, DriveChannel
from tickrig.host.canopen.dialogue import QueuedScript, SdoRequest
from tickrig.host.canopen.master.cia402.drive_driver import DriveDriver, DriveSettings
from tickrig.host.canopen.master.process_image import ProcessImage
from tickrig.wire.canopen.nmt import INVALID
from tickrig.wire.canopen.pdo import MappedObject

CONTROLWORD, TARGET, STATUSWORD = (0x6040, 0), (0x607A, 0), (0x6041, 0)


class Slave:
    """An image of a slave with one RPDO, and what was sent to it."""

    def __init__(self, transmission: int, cob_id: int = 0x202) -> None:
        rpdo = (MappedObject(0x6040, 0, 16), MappedObject(0x607A, 0, 32))
        tpdo = (MappedObject(0x6041, 0, 16), MappedObject(0x6061, 0, 8))
        pdos = (
            BusPdo(1, False, cob_id, transmission, mapping=rpdo),
            BusPdo(1, True, 0x182, 1, mapping=tpdo),
        )
        self.sent: list[str] = []
        self.image = ProcessImage(pdos, self.send)

    def send(self, can_id: int, data: bytes) -> None:
        self.sent.append(f"{can_id:03X}#{data.hex().upper()}")


@pytest.mark.parametrize("transmission", [254, 255])
def test_an_event_driven_pdo_goes_out_with_each_write_of_an_object_in_it(
    transmission: int,
) -> None:
    slave = Slave(transmission)
    for _ in range(2 * transmission):
        slave.image.sync()
    slave.image.write(TARGET, 0x0102)
    slave.image.write(CONTROLWORD, 0x000F)
    assert slave.sent == ["202#000002010000", "202#0F0002010000"]


@pytest.mark.parametrize(
    ("transmission", "sent"),
    [(1, [1, 2, 3, 4, 5, 6, 7]), (2, [0, 1, 1, 2, 2, 3, 3]), (3, [0, 0, 1, 1, 1, 2, 2])],
)
def test_a_synchronous_pdo_goes_out_with_each_nth_sync(transmission: int, sent: list[int]) -> None:
    slave = Slave(transmission)
    slave.image.write(CONTROLWORD, 0x000F)
    counts = []
    for _ in range(7):
        slave.image.sync()
        counts.append(len(slave.sent))
    assert counts == sent
    assert slave.sent == ["202#0F0000000000"] * sent[-1]


def test_an_acyclic_synchronous_pdo_waits_for_the_sync_after_a_write() -> None:
    slave = Slave(0)
    slave.image.sync()
    slave.image.write(CONTROLWORD, 0x0006)
    assert slave.sent == []
    slave.image.sync()
    slave.image.sync()
    assert slave.sent == ["202#060000000000"]


def test_a_pdo_that_is_not_there_carries_nothing() -> None:
    slave = Slave(255, INVALID | 0x202)
    assert not slave.image.sends(CONTROLWORD)
    assert slave.image.receives(STATUSWORD)
    assert list(slave.image.cob_ids) == [0x182]
    slave.image.write(CONTROLWORD, 0x000F)
    assert slave.sent == []


def test_it_is_said_what_pdos_carry() -> None:
    image = Slave(255).image
    assert (image.sends(CONTROLWORD), image.sends(STATUSWORD)) == (True, False)
    assert (image.receives(CONTROLWORD), image.receives(STATUSWORD)) == (False, True)


def test_what_is_doubted_is_fresh_when_it_comes_again() -> None:
    image = Slave(255).image
    assert image.is_fresh(STATUSWORD) is False
    image.receive(0x182, bytes.fromhex("370608"))
    assert image.is_fresh(STATUSWORD) is True
    image.doubt(STATUSWORD)
    assert image.is_fresh(STATUSWORD) is False
    assert image.is_fresh((0x6061, 0)) is True
    assert image.read(STATUSWORD) == 0x0637
    image.learn(STATUSWORD, 0x0250)
    assert image.is_fresh(STATUSWORD) is True
    image.write(CONTROLWORD, 0x000F)
    assert image.is_fresh(CONTROLWORD) is False


def test_a_tpdo_that_lacks_a_bit_is_too_short() -> None:
    mapping = (MappedObject(0x6000, 1, 8), MappedObject(0x6020, 1, 1))
    image = ProcessImage((BusPdo(1, True, 0x182, 1, mapping=mapping),), Slave(255).send)
    image.receive(0x182, b"\xff")
    assert not image.is_fresh((0x6000, 1))
    image.receive(0x182, b"\xff\x01")
    assert (image.read((0x6000, 1)), image.read((0x6020, 1))) == (0xFF, 1)


def test_a_tpdo_is_taken_and_one_that_is_too_short_is_not() -> None:
    slave = Slave(255)
    slave.image.receive(0x182, bytes.fromhex("370608"))
    slave.image.receive(0x182, bytes.fromhex("0000"))
    assert (slave.image.read(STATUSWORD), slave.image.read((0x6061, 0))) == (0x0637, 8)
    slave.image.learn(TARGET, 7)
    assert slave.image.read(TARGET) == 7
    assert slave.sent == []


def test_each_time_an_object_is_received_or_read_counts() -> None:
    image = Slave(255).image
    assert image.count(STATUSWORD) == 0
    image.receive(0x182, bytes.fromhex("370608"))
    image.learn(STATUSWORD, 0x0637)
    assert image.count(STATUSWORD) == 2


def test_the_objects_of_a_further_axis_are_800h_above() -> None:
    scripts: list[QueuedScript] = []
    settings = DriveSettings(DriveChannel("second"), axis=1)
    driver = DriveDriver(settings, Slave(255).image, scripts.append)
    step = next(driver.cycle())
    assert isinstance(step, SdoRequest)
    assert (step.index, step.sub) == (0x6841, 0)
