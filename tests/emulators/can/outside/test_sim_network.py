"""The canopen library as master of our slave in virtual time: nothing here waits."""

from __future__ import annotations

import threading
import time
from typing import Any

import canopen
import pytest
from canopen.lss import LssError
from canopen.nmt import NmtError
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError

from tests.device.canopen.profile_objects import DRIVE
from tests.emulators.sim_bench import NODE_ID, SimBench
from tickrig.emulators.can.outside.sim_network import SimNetwork
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.host.links.link import LinkClosed, LinkTimeout

BLOB = bytes(index * 7 % 251 for index in range(5_000))


@pytest.fixture
def bench() -> SimBench:
    return SimBench()


@pytest.fixture
def node(bench: SimBench) -> canopen.RemoteNode:
    node = bench.master()
    bench.network.run_for(10_000)
    return node


def test_expedited_transfer_goes_both_ways(bench: SimBench, node: canopen.RemoteNode) -> None:
    node.sdo[0x2002].raw = 0x1234_5678
    assert node.sdo[0x2002].raw == 0x1234_5678
    assert bench.rig.now_us < 20_000
    assert bench.log.text.startswith("705#00 605#2302200078563412 585#6002200000000000")


def test_segmented_transfer_goes_both_ways(node: canopen.RemoteNode) -> None:
    text = "a string of some length, in segments"
    node.sdo[0x2007].raw = text
    assert node.sdo[0x2007].raw == text


@pytest.mark.parametrize("crc", [False, True])
def test_block_transfer_goes_both_ways(node: canopen.RemoteNode, crc: bool) -> None:
    with node.sdo.open(
        0x2008, 0, "wb", size=len(BLOB), block_transfer=True, request_crc_support=crc
    ) as stream:
        stream.write(BLOB)
    with node.sdo.open(0x2008, 0, "rb", block_transfer=True, request_crc_support=crc) as stream:
        assert stream.read() == BLOB


def test_a_block_upload_over_a_bad_line_is_repeated(
    bench: SimBench, node: canopen.RemoteNode
) -> None:
    node.sdo[0x2008].raw = BLOB[:2_000]
    bench.wire.faults.arm("drop", "0.01")
    with node.sdo.open(0x2008, 0, "rb", block_transfer=True) as stream:
        heard = stream.read()
    assert heard == BLOB[:2_000]


def test_a_refusal_carries_its_abort_code(node: canopen.RemoteNode) -> None:
    with pytest.raises(SdoAbortedError) as refused:
        node.sdo.upload(0x5000, 0)
    assert refused.value.code == 0x0602_0000


def test_a_time_out_lasts_as_long_as_it_says(bench: SimBench) -> None:
    bench.wire.disconnect(bench.end)
    bench.wire.end()  # somebody acknowledges
    node, before_us, real_s = bench.master(), bench.rig.now_us, time.monotonic()
    node.sdo.RESPONSE_TIMEOUT = 5.0
    with pytest.raises(SdoCommunicationError, match="No SDO response received"):
        node.sdo.upload(0x1000, 0)
    assert bench.rig.now_us == before_us + 5_000_000 * node.sdo.MAX_RETRIES
    assert time.monotonic() < real_s + 3


def test_leftover_responses_do_not_bring_the_real_queue_back(
    bench: SimBench, node: canopen.RemoteNode
) -> None:
    bench.network.send_message(0x605, bytes.fromhex("4000100000000000"))
    bench.network.run_for(10_000)
    assert node.sdo[0x1000].raw == 0x000F_0191
    assert node.sdo[0x1000].raw == 0x000F_0191


def test_another_sdo_channel_is_on_the_same_clock(
    bench: SimBench, node: canopen.RemoteNode
) -> None:
    node.sdo[0x1201][1].raw = 0x6A5
    node.sdo[0x1201][2].raw = 0x6B5
    add_sdo: Any = node.add_sdo  # not annotated
    channel = add_sdo(0x6A5, 0x6B5)
    channel.network = bench.network
    assert channel.upload(0x1018, 1) == bytes.fromhex("01AB0000")


def test_the_master_leads_the_slave_through_the_nmt_states(
    bench: SimBench, node: canopen.RemoteNode
) -> None:
    node.sdo[0x1017].raw = 50
    for state in ("OPERATIONAL", "STOPPED", "PRE-OPERATIONAL"):
        node.nmt.state = state
        node.nmt.wait_for_heartbeat(1)
        assert node.nmt.state == state
    before_us = bench.rig.now_us
    node.nmt.state = "RESET"
    node.nmt.wait_for_bootup(1)
    assert bench.rig.now_us - before_us < 10_000


def test_waiting_for_a_heartbeat_or_boot_up_in_vain_ends(
    bench: SimBench, node: canopen.RemoteNode
) -> None:
    before_us = bench.rig.now_us
    with pytest.raises(NmtError, match="No boot-up or heartbeat received"):
        node.nmt.wait_for_heartbeat(3)
    assert bench.rig.now_us == before_us + 3_000_000
    with pytest.raises(NmtError, match="Timeout waiting for boot-up"):
        node.nmt.wait_for_bootup(10)
    assert 13_000_000 < bench.rig.now_us - before_us < 13_400_000


def test_node_guarding_is_sent_periodically(bench: SimBench, node: canopen.RemoteNode) -> None:
    nmt: Any = node.nmt  # not annotated
    nmt.start_node_guarding(0.1)
    bench.network.run_for(450_000)
    nmt.stop_node_guarding()
    bench.network.run_for(450_000)
    assert bench.log.text.count("705#R") == 5
    assert bench.log.text.endswith("705#R 705#7F")


def test_pdos_go_both_ways(bench: SimBench, node: canopen.RemoteNode) -> None:
    pdo: Any = node.pdo  # not annotated
    pdo.read()
    node.tpdo[1].trans_type = 1
    node.tpdo[1].save()
    node.nmt.state = "OPERATIONAL"
    bench.network.sync.start(0.02)
    assert node.tpdo[1].wait_for_reception(1) is not None
    heard = list[bytes]()
    node.tpdo[1].add_callback(lambda pdo: heard.append(bytes(pdo.data)))
    bench.slave.dictionary[0x6000, 1].value = 0x5A
    bench.network.run_for(100_000)
    sync: Any = bench.network.sync  # not annotated
    sync.stop()
    assert heard == [b"\x5a\x00"] * 5
    node.rpdo[1][0].raw = 0xA5
    node.rpdo[1].start(0.01)
    bench.network.run_for(5_000)
    assert bench.slave.dictionary[0x6200, 1].value == 0xA5
    node.rpdo[1][0].raw = 0x11
    node.rpdo[1].update()
    bench.network.run_for(15_000)
    node.rpdo[1].stop()
    assert bench.slave.dictionary[0x6200, 1].value == 0x11
    before_us = bench.rig.now_us
    assert node.tpdo[1].wait_for_reception(2) is None
    assert bench.rig.now_us == before_us + 2_000_000


def test_emergencies_are_waited_for(bench: SimBench, node: canopen.RemoteNode) -> None:
    before_us = bench.rig.now_us
    assert node.emcy.wait(timeout=2) is None
    assert bench.rig.now_us - before_us == pytest.approx(2_000_000, abs=1_000)
    bench.slave.emergency(0x3210, 0x04)
    assert node.emcy.wait(0x3210, timeout=2).code == 0x3210


def test_the_time_producer_sends_the_rigs_time(bench: SimBench) -> None:
    bench.network.run_for(1_000_000)
    bench.network.time.transmit()
    bench.network.run_for(1_000)
    days = (2000 - 1984) * 365 + 4
    assert bench.log.text.endswith(f"100#E8030000{days.to_bytes(2, 'little').hex().upper()}")


def test_the_lss_master_configures_a_slave() -> None:
    bench = SimBench(node_id=255)
    bench.network.run_for(10_000)
    lss: Any = bench.network.lss  # its methods are not annotated
    found, identity = lss.fast_scan()
    assert (found, identity) == (True, [0xAB01, 2, 0x3_0004, 0x5678])
    lss.send_switch_state_global(lss.WAITING_STATE)
    assert lss.send_switch_state_selective(*identity)
    lss.configure_node_id(NODE_ID)
    lss.send_switch_state_global(lss.WAITING_STATE)
    node = bench.master()
    node.nmt.wait_for_bootup(1)
    assert node.sdo[0x1000].raw == 0x000F_0191


def test_the_lss_master_gives_up_when_nobody_answers(bench: SimBench) -> None:
    bench.wire.disconnect(bench.end)
    bench.wire.end()
    lss: Any = bench.network.lss  # its methods are not annotated
    before_us = bench.rig.now_us
    with pytest.raises(LssError, match="No LSS response received"):
        lss.inquire_node_id()
    assert bench.rig.now_us - before_us == lss.RESPONSE_TIMEOUT * 1_000_000


def test_the_drive_profile_runs_on_sdo_and_on_pdo() -> None:
    bench = SimBench(DRIVE)
    node = bench.drive()
    bench.network.run_for(10_000)
    node.setup_402_state_machine(read_pdos=False)
    assert node.state == "SWITCH ON DISABLED"
    node.state = "OPERATION ENABLED"
    node.op_mode = "PROFILED VELOCITY"
    assert (node.state, node.op_mode) == ("OPERATION ENABLED", "PROFILED VELOCITY")
    assert bench.rig.now_us < 2_000_000


def test_a_drive_that_does_not_answer_is_given_up_in_virtual_time() -> None:
    bench = SimBench(DRIVE)
    node = bench.drive()
    bench.network.run_for(10_000)
    node.setup_402_state_machine(read_pdos=False)
    bench.slave.dictionary[0x6041, 0].source = lambda entry: b"\x40\x00"
    before_us, real_s = bench.rig.now_us, time.monotonic()
    with pytest.raises(RuntimeError, match="Timeout when trying to change state"):
        node.state = "OPERATION ENABLED"
    passed_us = bench.rig.now_us - before_us
    assert node.TIMEOUT_SWITCH_STATE_FINAL * 1e6 <= passed_us < 3_000_000
    assert time.monotonic() < real_s + 5


def test_the_scanner_finds_all_nodes(bench: SimBench) -> None:
    bench.network.scanner.search()
    bench.network.clock.sleep(0.1)
    assert bench.network.scanner.nodes == [NODE_ID]


def test_a_run_is_the_same_each_time() -> None:
    def run() -> list[str]:
        bench = SimBench()
        node = bench.master()
        bench.network.run_for(10_000)
        bench.wire.faults.arm("drop", "0.02")
        node.sdo.MAX_RETRIES = 5
        node.sdo[0x1017].raw = 10
        for number in range(50):
            node.sdo[0x2002].raw = number
        return bench.log.lines

    assert run() == run()


def test_objects_of_other_networks_stay_as_they_are(node: canopen.RemoteNode) -> None:
    other = canopen.RemoteNode(NODE_ID, node.object_dictionary)
    assert type(other.nmt.state_update) is threading.Condition
    assert type(other.sdo) is not type(node.sdo)
    assert type(other.nmt).wait_for_bootup.__globals__["time"] is time
    assert type(node.nmt).__module__ == "canopen.nmt"
    assert isinstance(node.nmt, canopen.nmt.NmtMaster)


def test_no_thread_is_started() -> None:
    bench = SimBench()
    with bench.network.connect() as network:
        node = bench.master()
        network.sync.start(0.01)
        network.run_for(10_000)
        node.sdo.upload(0x1000, 0)
        assert threading.active_count() == 1
    with pytest.raises(LinkClosed):
        network.sync.transmit()


def test_waiting_for_ever_for_nothing_is_told() -> None:
    wire = CanWire()
    network = SimNetwork(Rig(), wire.end())
    with pytest.raises(LinkTimeout, match="nothing will ever happen"):
        network.wait(lambda: False, None)


def test_29_bit_and_remote_frames_can_be_sent(bench: SimBench) -> None:
    bench.network.send_message(0x12345, b"\x01")
    bench.network.send_message(0x185, b"", remote=True)
    bench.network.run_for(1_000)
    assert bench.log.text == "00012345#01 185#R"
