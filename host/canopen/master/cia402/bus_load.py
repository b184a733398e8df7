"""The bus load of drives: SDO polling and PDOs."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from math import fsum
from typing import Final

from tickrig.host.canopen.bus_file.bus_file import BusFile
from tickrig.host.canopen.bus_file.bus_values import BusMaster, BusPdo, BusSlave
from tickrig.host.canopen.bus_file.notes import BusFileNotes
from tickrig.host.canopen.data_sheet.rule import RuleFinding
from tickrig.host.canopen.master.cia402 import drive_driver
from tickrig.host.canopen.master.cia402.drive_mode import TARGETS, DriveObject
from tickrig.host.canopen.master.process_image import EVENT_DRIVEN, Key, keys
from tickrig.host.text.values import counted
from tickrig.wire.can import data_frame, frame_bits
from tickrig.wire.canopen.nmt import CAN_ID_MASK
from tickrig.wire.canopen.sdo import (
    DownloadInitiateRequest,
    DownloadInitiateResponse,
    UploadInitiateRequest,
    UploadInitiateResponse,
)
from tickrig.wire.canopen.sdo_frame import REQUEST_COB_ID, RESPONSE_COB_ID

_MOST: Final = 0.8
"""Bus load above which periods are skipped, because answers do not arrive in time."""

_Load = float
"""Bus load in bits per microsecond."""


def check_load(bus: BusFile) -> tuple[RuleFinding, ...]:
    """Return a warning if the PDOs and SDO polling of the drives in a bus.yml overload the bus.

    The number of bits of a frame depends on its data, because of stuff bits. It is calculated for
    data bytes that are all 0.
    """
    notes, master = BusFileNotes(), bus.master
    if master is not None:
        polled = [load for slave in bus.slaves.values() if (load := polling_load(slave, master))]
        rate = master.baudrate / 1_000
        sdo = fsum(polled) / rate
        pdos = fsum(pdo_load(slave, master) for slave in bus.slaves.values()) / rate
        if sdo + pdos > _MOST:
            text = _said(len(polled), sdo, pdos)
            notes.note("bus-load", master.place, "", f"{master.baudrate} kbit/s: {text}")
    return notes.all


def _said(drives: int, sdo: _Load, pdos: _Load) -> str:
    """Return the shares of the load, and the number of drives that the bus can carry."""
    text = f"{sdo + pdos:.0%} of the bus in each period"
    if not drives:
        return f"{text} for PDOs"
    fitting = max(0, int(drives * (_MOST - pdos) / sdo))
    what = f"polling of {counted(drives, 'drive')} by SDO {sdo:.0%}, PDOs {pdos:.0%}"
    return f"{text}: {what}; {_MOST:.0%} is enough for {fitting} of them"


def polling_load(slave: BusSlave, master: BusMaster) -> _Load:
    """Return the SDO requests and responses of a drive in each period."""
    period_us = drive_driver.period_us_of(slave) or master.sync_period_us
    if not (drive_driver.is_drive(slave) and slave.boot and period_us):
        return 0.0
    there = {(row.index, row.sub) for row in slave.device.entries}
    sent, received = _mapped(slave, transmit=True), _mapped(slave, transmit=False)
    bits = 0
    for axis in range(slave.num_channels):
        for item in drive_driver.READ:
            if (key := _key(item, axis)) in there - sent:
                response = UploadInitiateResponse(*key, bytes(item.size), item.size)
                bits += _bits(slave, UploadInitiateRequest(*key).encode(), response.encode())
        targets = {_key(item, axis): item for item in TARGETS}
        written = {_key(drive_driver.CONTROLWORD, axis): drive_driver.CONTROLWORD}
        if not received & targets.keys():
            written |= dict(list(targets.items())[:1])
        for key, item in written.items():
            if key in there - received:
                request = DownloadInitiateRequest(*key, bytes(item.size), item.size)
                bits += _bits(slave, request.encode(), DownloadInitiateResponse(*key).encode())
    return bits / period_us


def _key(item: DriveObject, axis: int) -> Key:
    return item.index + drive_driver.AXIS * axis, item.sub


def _mapped(slave: BusSlave, *, transmit: bool) -> set[Key]:
    pdos = (pdo for pdo in slave.pdos if pdo.enabled and pdo.transmit is transmit)
    return {key for pdo in pdos for key in keys(pdo)}


def _bits(slave: BusSlave, request: bytes, response: bytes) -> int:
    there = data_frame(REQUEST_COB_ID + slave.node_id, request)
    back = data_frame(RESPONSE_COB_ID + slave.node_id, response)
    return frame_bits(there) + frame_bits(back)


def pdo_load(slave: BusSlave, master: BusMaster) -> _Load:
    """Return the load of periodic PDOs."""
    written_us = 0
    if drive_driver.is_drive(slave):
        written_us = drive_driver.period_us_of(slave) or master.sync_period_us
    return fsum(_loads((pdo for pdo in slave.pdos if pdo.enabled), master, written_us))


def _loads(pdos: Iterable[BusPdo], master: BusMaster, written_us: int) -> Iterator[_Load]:
    for pdo in pdos:
        period_us = master.sync_period_us * max(1, pdo.transmission)
        if pdo.transmission >= EVENT_DRIVEN:
            period_us = 1_000 * pdo.event_timer_ms if pdo.transmit else written_us
        size = sum(mapped.bits for mapped in pdo.mapping) + 7 >> 3
        if period_us and 0 < size <= 8:
            frame = data_frame(pdo.cob_id & CAN_ID_MASK, bytes(size))
            yield frame_bits(frame) / period_us
