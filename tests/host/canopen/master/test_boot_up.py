"""The boot-up of a slave, letter by letter (CiA 302-2, boot slave process)."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import pytest

from tests.host.canopen.master.network import (
    DEVICE_TYPE,
    HEARTBEAT,
    NODE_ID,
    PRODUCT,
    REVISION,
    SERIAL,
    SOFTWARE,
    VENDOR,
    Network,
    network,
    plain_slave,
)
from tickrig.device.canopen.models.epos import make_epos
from tickrig.host.canopen.master.assignment import ObjectWrite, SlaveAssignment
from tickrig.host.canopen.master.boot_slave import BootStatus
from tickrig.host.canopen.master.canopen_master import BootFailed
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import NmtCommand, NmtState

LEFT = SlaveAssignment(
    NODE_ID,
    "left",
    device_type=DEVICE_TYPE,
    vendor_id=VENDOR,
    product_code=PRODUCT,
    revision=REVISION,
    serial=SERIAL,
)
GUARDED = replace(LEFT, writes=(HEARTBEAT,), heartbeat_us=150_000)


def u32(index: int, sub: int, value: int) -> ObjectWrite:
    return ObjectWrite(index, sub, value.to_bytes(4, "little"))


def failed_boot(net: Network, within_us: int = 3_000_000) -> str:
    with pytest.raises(BootFailed) as failure:
        net.master.boot(within_us)
    return str(failure.value)


def test_a_slave_is_asked_in_the_order_of_the_standard_and_started() -> None:
    with network(GUARDED) as net:
        net.master.boot()
        asked = [frame for frame in net.heard() if frame.startswith(("605", "000"))]
    assert asked == [
        "000#8200",
        "605#4000100000000000",
        "605#4018100100000000",
        "605#4018100200000000",
        "605#4018100300000000",
        "605#4018100400000000",
        "605#2B17100032000000",
        "000#0105",
    ]


def test_a_boot_up_is_told_step_by_step() -> None:
    with network(replace(GUARDED, product_code=0, revision=0, serial=0)) as net:
        net.master.boot()
        told = [line.split("ms  ")[-1] for line in net.master.explain("left").splitlines()]
    assert told == [
        "1000h:00 device type: 00020192h; as expected",
        f"1018h:01 vendor-ID: {VENDOR:08X}h; as expected",
        "1017h:00 := 0032h: taken; goes on",
        "heartbeat: Pre-operational; goes on",
        "node 5 left: booted",
    ]


def test_a_booted_slave_is_operational_and_stays_so() -> None:
    with network(GUARDED) as net:
        net.master.boot()
        net.master.run_for(1_000_000)
        assert net.master.slave("left").state is NmtState.OPERATIONAL
        assert net.bench["node5"].get("state") == "Operational"
        assert net.master.slave("left").lost == 0


def test_a_node_that_is_no_slave_of_the_master_is_left_alone() -> None:
    with network(LEFT, slaves=(plain_slave(), plain_slave(9))) as net:
        net.master.boot()
        net.master.run_for(100_000)
        assert 9 in net.master.nmt.strangers
        assert not [frame for frame in net.heard() if frame.startswith("609")]


def test_b_without_an_answer_the_slave_is_tried_again_each_second() -> None:
    with network(replace(LEFT, mandatory=True)) as net:
        net.bench["node5"].switch_off()
        told = failed_boot(net, 1_500_000)
        assert told.startswith("node 5 left: not booted, still tried; 1000h:00 device type: ")
        asked = [frame[4:12] for frame in net.heard() if frame.startswith("605#40")]
        # four tries of 100 ms, then one second later again; 1001h as 1000h may still be answered
        assert asked == ["40001000", *["40011000"] * 4]
        net.bench["node5"].switch_on()
        net.master.boot()


def test_b_a_mandatory_slave_is_given_up_after_its_boot_time() -> None:
    with network(replace(LEFT, mandatory=True), boot_time_us=1_600_000) as net:
        net.bench["node5"].switch_off()
        net.bench.run_for("7s")
        assert failed_boot(net, 5_000_000) == (
            f"node 5 left: B {BootStatus.NO_ANSWER.text};"
            " 1000h:00 device type: 1000h:00 was not answered"
        )
        assert 8_700_000 < net.master.now_us < 9_000_000
        assert net.master.nmt.halted


@pytest.mark.parametrize(
    ("letter", "wrong", "index"),
    [
        ("C", {"device_type": 0x0003_0191}, "1000h:00"),
        ("D", {"vendor_id": 1}, "1018h:01"),
        ("M", {"product_code": 1}, "1018h:02"),
        ("N", {"revision": 1}, "1018h:03"),
        ("O", {"serial": 1}, "1018h:04"),
    ],
)
def test_another_identity_ends_the_boot_up(letter: str, wrong: dict[str, Any], index: str) -> None:
    with network(replace(LEFT, **wrong)) as net:
        failed_boot(net)
        assert net.status() == letter
        last = net.master.explain("left").splitlines()[-2]
        assert index in last
        assert f"not {next(iter(wrong.values())):08X}h" in last
        assert "000#0105" not in net.heard()


def test_e_a_slave_to_be_kept_alive_without_a_heartbeat() -> None:
    with network(replace(LEFT, reset_communication=False, heartbeat_us=150_000)) as net:
        failed_boot(net)
        assert net.status() == "E"


def test_f_a_slave_to_be_kept_alive_that_does_not_answer_to_guarding() -> None:
    with network(replace(LEFT, reset_communication=False)) as net:
        serial = net.bench.on_line("585#43181004*")
        net.bench["node5"].fault("power_off", when=serial)
        failed_boot(net)
        assert net.status() == "F"
        assert "705#R1" in net.heard()


def test_l_a_slave_that_is_operational_is_kept_alive() -> None:
    with network(replace(LEFT, reset_communication=False, writes=(HEARTBEAT,))) as net:
        net.bench.run_for("10ms")
        link = net.bench.link
        link.send((CanFrame.parse("000#0105"),))
        net.bench.run_for("10ms")
        net.master.boot()
        assert net.status() == "L"
        heard = net.heard()
        assert "000#8200" not in heard
        assert "000#8205" not in heard
        assert "000#8204" in heard  # all others are reset, one by one
        assert "605#2B17100032000000" not in heard


def test_a_slave_to_be_kept_alive_that_is_not_operational_is_reset_and_booted() -> None:
    with network(replace(LEFT, reset_communication=False, writes=(HEARTBEAT,))) as net:
        net.master.boot()
        heard = net.heard()
        assert net.status() == ""
        assert heard.index("000#8205") < heard.index("605#2B17100032000000")


def test_g_a_slave_that_cannot_say_its_software() -> None:
    with network(SlaveAssignment(5, software_version=1), slaves=(make_epos(5),)) as net:
        failed_boot(net)
        assert net.status() == "G"


def test_h_a_slave_with_other_software_that_may_not_be_updated() -> None:
    with network(replace(LEFT, software_version=SOFTWARE + 1)) as net:
        failed_boot(net)
        assert net.status() == "H"


def test_the_expected_software_is_taken() -> None:
    with network(replace(LEFT, software_version=SOFTWARE)) as net:
        net.master.boot()
        assert "1F56h:01" in net.master.explain("left")


def test_j_a_write_that_is_refused_ends_the_boot_up_and_is_named() -> None:
    with network(replace(GUARDED, writes=(HEARTBEAT, u32(0x1000, 0, 1)))) as net:
        failed_boot(net)
        assert net.status() == "J"
        assert "1000h:00 := 00000001h: 1000h:00 aborted: 06010002h" in net.master.explain("left")


def test_j_a_slave_that_dies_half_way_is_booted_when_it_is_back() -> None:
    writes = (HEARTBEAT, u32(0x1006, 0, 10_000), u32(0x1007, 0, 5_000))
    with network(replace(GUARDED, writes=writes)) as net:
        net.bench["node5"].fault(
            "power_off", when=net.bench.on_line("585#6006100000000000"), for_="500ms"
        )
        failed_boot(net, 400_000)
        assert net.status() == "J"
        assert "1007h:00 was not answered" in net.master.explain(5)
        net.master.run_for(1_000_000)
        assert net.status() == ""
        assert net.master.slave(5).state is NmtState.OPERATIONAL


@pytest.mark.parametrize("kept", [True, False])
def test_the_configuration_is_written_unless_its_date_and_time_are_kept(kept: bool) -> None:
    dated = replace(LEFT, configuration_date=123, configuration_time=456)
    stamps = (HEARTBEAT, u32(0x1020, 1, 123), u32(0x1020, 2, 456))
    save = (ObjectWrite(0x1010, 1, b"save"),) if kept else ()
    with network(replace(dated, writes=(*stamps, *save))) as net:
        net.master.boot()
        net.master.nmt.command(NmtCommand.RESET_COMMUNICATION)
        net.master.run_for(500_000)
        assert net.heard().count("605#2B17100032000000") == (1 if kept else 2)
        assert net.status() == ""


def test_k_a_slave_without_its_first_heartbeat() -> None:
    with network(replace(LEFT, heartbeat_us=150_000)) as net:
        failed_boot(net)
        assert net.status() == "K"
        assert "heartbeat: none within 150 ms" in net.master.explain(5)


@pytest.mark.parametrize(
    ("sub", "command"), [(1, NmtCommand.RESET_NODE), (2, NmtCommand.RESET_COMMUNICATION)]
)
def test_parameters_are_restored_before_the_configuration(sub: int, command: NmtCommand) -> None:
    with network(replace(LEFT, restore_sub=sub, writes=(HEARTBEAT,))) as net:
        net.master.boot()
        heard = net.heard()
    reset = f"000#{command:02X}05"
    wanted = [f"605#2311100{sub}6C6F6164", reset, "605#2B17100032000000", "000#0105"]
    assert sorted(wanted, key=heard.index) == wanted


def test_k_a_boot_up_is_no_first_heartbeat() -> None:
    with network(GUARDED) as net:
        written = net.bench.on_line("585#6017100000000000")
        net.bench["node5"].fault("power_off", when=written, for_="50ms")
        failed_boot(net)
        assert net.status() == "K"
        assert net.heard().count("705#00") == 2  # power-on, and the one that was heard


def test_a_configuration_that_is_dated_is_told_to_be_so() -> None:
    dated = replace(LEFT, configuration_date=123, configuration_time=456)
    stamps = (u32(0x1020, 1, 123), u32(0x1020, 2, 456), ObjectWrite(0x1010, 1, b"save"))
    with network(replace(dated, writes=stamps)) as net:
        net.master.boot()
        first = net.master.explain("left")
        net.master.nmt.command(NmtCommand.RESET_COMMUNICATION)
        net.master.run_for("200ms")
        second = net.master.explain("left")
    assert "1020h:01 configuration date: 00000000h; not 0000007Bh: configuring again" in first
    assert "1020h:01 configuration date: 0000007Bh; as expected" in second
    assert "1020h:02 configuration time: 000001C8h; as expected" in second


def test_a_date_without_a_time_is_not_asked_for() -> None:
    with network(replace(LEFT, configuration_date=123)) as net:
        net.master.boot()
        assert "1020h" not in net.master.explain("left")


def test_a_slave_that_another_boots_is_watched_and_not_started() -> None:
    with network(SlaveAssignment(5, boots=False)) as net:
        net.master.boot()
        assert not [frame for frame in net.heard() if frame.startswith(("605", "000#01"))]
        assert "1F81h: bit 2 is 0; not booted by this master" in net.master.explain(5)


def test_a_slave_that_falls_silent_is_reset_and_booted_anew() -> None:
    with network(GUARDED) as net:
        net.master.boot()
        net.bench["node5"].fault("power_off", for_="300ms")
        net.master.run_for(200_000)
        slave = net.master.slave("left")
        assert (slave.lost, slave.state) == (1, None)
        assert "000#8105" in net.heard()
        assert net.master.wait_until(lambda: slave.state is NmtState.OPERATIONAL, 2_000_000)


def test_a_slave_that_misses_its_reset_is_not_booted_again_until_it_is_reset() -> None:
    with network(GUARDED) as net:
        net.master.boot()
        net.bench["node5"].fault("unplugged", for_="300ms")
        net.master.run_for("2s")
        slave = net.master.slave("left")
        assert (slave.lost, net.heard().count("000#8105")) == (1, 1)
        told = [line.split("ms  ")[-1] for line in net.master.explain("left").splitlines()]
        assert told[-4:] == [
            "node 5 left: booted",
            "heartbeat: none within 150 ms; lost; reset node is sent, once",
            "heartbeat: Operational; sends again, but is not booted: no boot-up",
            "node 5 left: now Operational",
        ]
        net.master.nmt.command(NmtCommand.RESET_NODE, 5)
        net.master.run_for("1s")
        told = [line.split("ms  ")[-1] for line in net.master.explain("left").splitlines()]
        assert told[0] == "heartbeat: none within 150 ms; lost; reset node is sent, once"
        assert told[-1] == "node 5 left: booted"


def test_a_guarded_slave_is_asked_in_each_guard_time_and_lost_after_its_life_time() -> None:
    with network(replace(LEFT, guard_us=50_000, life_time_factor=3)) as net:
        net.master.boot()
        net.master.run_for("1010ms")
        slave, asked = net.master.slave("left"), net.heard().count("705#R1")
        assert (slave.lost, asked) == (0, 21)
        assert "000#8105" not in net.heard()
        net.bench["node5"].switch_off()
        net.master.run_for("95ms")
        assert (slave.lost, net.heard().count("705#R1") - asked) == (0, 2)
        net.master.run_for("50ms")
        assert (slave.lost, slave.state, net.heard().count("000#8105")) == (1, None, 1)
        net.master.run_for("1s")
        assert (slave.lost, net.heard().count("000#8105")) == (1, 1)
        net.bench["node5"].switch_on()
        net.master.run_for("1s")
        assert (slave.lost, slave.state) == (1, NmtState.OPERATIONAL)


def test_a_slave_that_falls_silent_after_its_first_heartbeat_is_lost() -> None:
    with network(GUARDED) as net:
        net.bench["node5"].fault("power_off", when=net.bench.on_line("705#7F"))
        net.master.boot()
        net.master.run_for("140ms")
        assert net.master.slave("left").lost == 0
        net.master.run_for("10ms")
        assert net.master.slave("left").lost == 1


def test_a_slave_of_which_nothing_is_known_is_taken_for_pre_operational() -> None:
    with network(SlaveAssignment(5, boots=False, mandatory=True)) as net:
        net.bench["node5"].switch_off()
        net.master.boot()
        assert net.master.slave(5).state is NmtState.PRE_OPERATIONAL


def test_what_is_no_state_is_passed_over() -> None:
    with network(GUARDED) as net:
        net.master.boot()
        for text in ("705#11", "705#", "705#0400"):
            net.master.slave("left").receive(net.master.now_us, CanFrame.parse(text))
        assert net.master.slave("left").state is NmtState.OPERATIONAL


@pytest.mark.parametrize(
    ("plan", "command"), [({"stops_all": True}, "000#0200"), ({"resets_all": True}, "000#8100")]
)
def test_the_loss_of_a_mandatory_slave_may_stop_or_reset_all(
    plan: dict[str, Any], command: str
) -> None:
    with network(replace(GUARDED, mandatory=True), SlaveAssignment(6), **plan) as net:
        net.master.boot()
        net.bench["node5"].switch_off()
        net.master.run_for(300_000)
        assert command in net.heard()


def test_nothing_is_started_before_all_mandatory_slaves_if_all_are_started_together() -> None:
    with network(GUARDED, SlaveAssignment(6, mandatory=True), starts_all=True) as net:
        net.bench["node6"].fault("power_off", for_="700ms")
        net.master.run_for(600_000)
        assert net.status() == ""
        assert net.master.slave(5).state is NmtState.PRE_OPERATIONAL
        net.master.boot()
        assert net.master.nmt.state is NmtState.OPERATIONAL
        net.master.run_for(100_000)
        assert net.master.slave(5).state is NmtState.OPERATIONAL


def test_a_master_that_may_not_start_nodes_leaves_them_pre_operational() -> None:
    with network(GUARDED, starts_nodes=False) as net:
        net.master.boot()
        net.master.run_for(300_000)
        assert net.master.slave(5).state is NmtState.PRE_OPERATIONAL
        assert net.master.nmt.state is NmtState.OPERATIONAL


def test_a_master_that_does_not_start_itself_stays_pre_operational() -> None:
    with network(GUARDED, starts=False, starts_all=True) as net:
        net.master.boot()
        net.master.run_for("300ms")
        assert net.master.nmt.state is NmtState.PRE_OPERATIONAL
        assert net.master.slave(5).state is NmtState.PRE_OPERATIONAL


def test_all_are_started_by_one_command_if_the_master_boots_none_of_them() -> None:
    slave = SlaveAssignment(5, boots=False, mandatory=True)
    with network(slave, slaves=(plain_slave(), plain_slave(6)), starts_all=True) as net:
        net.bench.run_for("10ms")  # nodes that initialise hear no command
        net.master.boot()
        assert [frame for frame in net.heard() if frame.startswith("000#01")] == ["000#0100"]
        assert net.bench["node6"].get("state") == "Operational"


def test_a_sync_has_a_counter_if_it_is_to_have_one() -> None:
    with network(GUARDED, sync_us=10_000, sync_overflow=3) as net:
        net.master.run_for("45ms")
        syncs = [frame for frame in net.heard() if frame.startswith("080#")]
    assert syncs == ["080#01", "080#02", "080#03", "080#01"]
