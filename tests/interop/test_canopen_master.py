"""The canopen library as master of our slave."""

from __future__ import annotations

import threading
import time
from typing import Any

import canopen
import pytest

from tests.interop.buses import patience
from tests.interop.slave import Slave

pytestmark = pytest.mark.realtime

PATIENCE_S = patience(10)
BLOB = bytes(index * 7 % 251 for index in range(5_000))


def operate(master: Any) -> None:
    master.nmt.state = "OPERATIONAL"
    master.sdo[0x1017].raw = 100
    master.nmt.wait_for_heartbeat(PATIENCE_S)


@pytest.mark.essential
def test_the_master_leads_it_through_the_nmt_states(master: Any, slave: Slave) -> None:
    master.sdo[0x1017].raw = 50
    for state, shown in (
        ("OPERATIONAL", "Operational"),
        ("STOPPED", "Stopped"),
        ("PRE-OPERATIONAL", "Pre-operational"),
    ):
        master.nmt.state = state
        slave.wait_for("state", shown)
        master.nmt.wait_for_heartbeat(PATIENCE_S)
        assert master.nmt.state == state


def test_heartbeats_come_at_the_time_that_was_written(master: Any) -> None:
    master.sdo[0x1017].raw = 20
    stamps = []
    for _ in range(10):
        master.nmt.wait_for_heartbeat(PATIENCE_S)
        stamps.append(time.monotonic())
    assert stamps[-1] - stamps[0] > 0.09


@pytest.mark.essential
def test_numbers_go_by_expedited_transfer(master: Any, slave: Slave) -> None:
    assert master.sdo[0x1018][1].raw == slave.get("0x1018:1")
    for index, value in ((0x2000, 0x12), (0x2001, 0x1234), (0x2002, 0x1234_5678)):
        master.sdo[index].raw = value
        assert master.sdo[index].raw == value
    slave.wait_for("0x2002", 0x1234_5678)


@pytest.mark.essential
def test_longer_values_go_by_segmented_transfer(master: Any, slave: Slave) -> None:
    text = "a string of some length, in segments"
    master.sdo[0x2007].raw = text
    assert master.sdo[0x2007].raw == text
    slave.wait_for("0x2007", text)
    master.sdo[0x2003].raw = 2**64 - 2
    assert master.sdo[0x2003].raw == 2**64 - 2
    master.sdo[0x2008].raw = BLOB[:900]
    assert master.sdo[0x2008].raw == BLOB[:900]


def test_a_domain_goes_by_block_transfer(master: Any, slave: Slave) -> None:
    with master.sdo[0x2008].open(
        "wb", buffering=1024, size=len(BLOB), block_transfer=True
    ) as stream:
        stream.write(BLOB)
    slave.wait_for("0x2008", f"hex:{BLOB.hex()}")
    with master.sdo[0x2008].open("rb", block_transfer=True) as stream:
        assert stream.read() == BLOB


@pytest.mark.essential
def test_a_refusal_carries_its_abort_code(master: Any) -> None:
    with pytest.raises(canopen.SdoAbortedError) as refused:
        master.sdo.upload(0x5FFF, 0)
    assert refused.value.code == 0x0602_0000
    with pytest.raises(canopen.SdoAbortedError) as refused:
        master.sdo[0x2006].raw = 0x21
    assert refused.value.code == 0x0609_0031


@pytest.mark.essential
def test_an_input_that_changes_sends_its_tpdo(master: Any, slave: Slave) -> None:
    master.tpdo.read()
    operate(master)
    for line in (2, 4, 5, 7):
        slave.set(f"di{line}", 1)
    deadline = time.monotonic() + PATIENCE_S
    while master.tpdo[1][0].raw != 0x5A:
        assert time.monotonic() < deadline
        master.tpdo[1].wait_for_reception(0.5)


@pytest.mark.essential
def test_an_rpdo_sets_an_output(master: Any, slave: Slave) -> None:
    master.rpdo.read()
    operate(master)
    master.rpdo[1][0].raw = 0xA5
    master.rpdo[1].transmit()
    slave.wait_for("0x6200:1", 0xA5)


def test_the_master_maps_a_pdo_anew_and_sync_brings_it(
    master: Any, network: canopen.Network, slave: Slave
) -> None:
    master.tpdo.read()
    pdo = master.tpdo[2]
    pdo.clear()
    pdo.add_variable(0x2001)
    pdo.add_variable(0x2000)
    pdo.trans_type, pdo.event_timer, pdo.enabled = 1, 0, True
    pdo.save()
    slave.set("0x2001", 0xBEEF)
    slave.set("0x2000", 0x42)
    operate(master)
    deadline = time.monotonic() + PATIENCE_S
    while (pdo[0].raw, pdo[1].raw) != (0xBEEF, 0x42):
        assert time.monotonic() < deadline
        network.sync.transmit()
        pdo.wait_for_reception(0.5)


@pytest.mark.essential
def test_an_error_is_told_by_emcy_and_its_end_too(master: Any, slave: Slave) -> None:
    heard: list[Any] = []
    master.emcy.add_callback(heard.append)
    slave.set("emergency", 0x2310)
    deadline = time.monotonic() + PATIENCE_S
    while not heard:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert (heard[0].code, heard[0].register) == (0x2310, 0x03)
    assert master.sdo[0x1001].raw == 0x03
    assert master.sdo[0x1003][1].raw & 0xFFFF == 0x2310
    slave.set("emergency", 0)
    while len(heard) < 2:
        assert time.monotonic() < deadline
        time.sleep(0.01)
    assert (heard[1].code, heard[1].register) == (0, 0)


def test_a_node_without_power_is_gone_and_boots_when_it_is_back(master: Any, slave: Slave) -> None:
    master.sdo.RESPONSE_TIMEOUT = 0.5
    slave.set("power_off", 1)
    with pytest.raises(canopen.SdoCommunicationError):
        master.sdo.upload(0x1000, 0)
    booted = threading.Event()
    master.nmt.add_heartbeat_callback(lambda state: None if state else booted.set())
    slave.set("power_off", 0)
    assert booted.wait(PATIENCE_S)
