"""What the NMT master says of itself and to all, frame by frame (CiA 302-2)."""

from __future__ import annotations

from typing import Any

from tickrig.host.canopen.master.assignment import MasterPlan, SlaveAssignment
from tickrig.host.canopen.master.nmt_master import NmtMaster, ProcessData
from tickrig.wire.can import CanFrame
from tickrig.wire.canopen.nmt import NmtCommand, NmtState
from tickrig.wire.instant import NEVER

DEVICE_TYPE = "4300100092010200"


class Desk:
    """A master without a bus: it is told what was heard, and says what it sends."""

    def __init__(self, *slaves: SlaveAssignment, **plan: Any) -> None:
        self.nmt = NmtMaster(MasterPlan(slaves, node_id=1, **plan))
        self.now_us = 0

    def at(self, now_us: int, *heard: str) -> list[str]:
        self.now_us = now_us
        frames = tuple((now_us, CanFrame.parse(text)) for text in heard)
        return [str(frame) for frame in self.nmt.tick(now_us, frames)]

    def boot(self, node_id: int) -> list[str]:
        """Let a slave of which nothing but its device type is expected boot."""
        asked = self.at(self.now_us, f"{0x700 + node_id:03X}#00")
        assert f"{0x600 + node_id:03X}#4000100000000000" in asked
        return self.at(self.now_us, f"{0x580 + node_id:03X}#{DEVICE_TYPE}")


class Spy(ProcessData):
    """Notes what it is told."""

    def __init__(self) -> None:
        super().__init__({})
        self.calls: list[str] = []

    def receive(self, frame: CanFrame) -> None:
        self.calls.append(str(frame))

    def sync(self) -> None:
        self.calls.append("sync")

    def tick(self, now_us: int, *, sync: bool) -> None:
        if sync:
            self.calls.append("after sync")


def test_a_master_boots_resets_all_and_tells_its_state() -> None:
    desk = Desk(SlaveAssignment(2, mandatory=True), heartbeat_us=100_000)
    assert desk.at(5) == ["701#00", "000#8200", "602#4000100000000000"]
    assert desk.nmt.due_us == 100_005
    desk.at(50_000, f"582#{DEVICE_TYPE}")
    assert desk.at(100_004) == []
    assert desk.at(100_005) == ["701#05"]


def test_one_slave_that_is_not_to_be_reset_has_all_others_reset_one_by_one() -> None:
    slaves = (SlaveAssignment(2), SlaveAssignment(3, reset_communication=False))
    sent = Desk(*slaves).at(0)
    reset = [f"000#82{node_id:02X}" for node_id in range(2, 128) if node_id != 3]
    assert sent == ["701#00", *reset, "603#4000100000000000"]


def test_a_master_that_waits_for_a_slave_is_pre_operational() -> None:
    desk = Desk(SlaveAssignment(2, mandatory=True), heartbeat_us=90_000)
    desk.at(0)
    assert "701#7F" in desk.at(90_000)


def test_a_master_without_slaves_is_operational_at_once() -> None:
    desk = Desk()
    desk.at(0)
    assert desk.nmt.state is NmtState.OPERATIONAL


def test_slaves_that_are_optional_are_booted_when_they_report() -> None:
    desk = Desk(SlaveAssignment(2), SlaveAssignment(3))
    assert desk.at(0) == ["701#00", "000#8200"]
    assert desk.boot(3) == ["000#0103"]


def test_an_optional_slave_does_not_wait_for_a_mandatory_one() -> None:
    desk = Desk(SlaveAssignment(2, mandatory=True), SlaveAssignment(3))
    desk.at(0)
    assert desk.boot(3) == ["000#0103"]
    assert desk.nmt.state is NmtState.PRE_OPERATIONAL


def test_together_means_those_that_have_booted_and_no_others() -> None:
    slaves = (
        SlaveAssignment(2, mandatory=True),
        SlaveAssignment(3),
        SlaveAssignment(4, device_type=1),
        SlaveAssignment(5, boots=False),
        SlaveAssignment(6),
    )
    desk = Desk(*slaves, starts_all=True)
    desk.at(0)
    for node_id in (3, 4):
        assert desk.boot(node_id) == []
    desk.at(desk.now_us, "705#00")
    assert desk.at(desk.now_us, f"582#{DEVICE_TYPE}") == ["000#0102", "000#0103"]
    assert desk.boot(6) == ["000#0106"]


def test_a_heartbeat_of_a_stranger_or_of_oneself_is_no_boot_up() -> None:
    desk = Desk()
    desk.at(0)
    desk.at(1, "709#05", "701#00", "708#00", "707#", "00000706#00")
    assert desk.nmt.strangers == [8]


def test_a_command_from_outside_is_sent_with_the_next_tick_which_is_due() -> None:
    desk = Desk(SlaveAssignment(2))
    desk.at(0)
    assert desk.nmt.due_us > 1_000_000
    desk.nmt.command(NmtCommand.STOP, 2)
    assert desk.nmt.due_us == 0
    assert desk.at(10) == ["000#0202"]


def test_what_slaves_send_goes_where_it_belongs() -> None:
    desk, spy = Desk(SlaveAssignment(2)), Spy()
    desk.at(0)
    desk.nmt.process_data = spy
    desk.at(1, "082#3110010203040506", "182#3706", "702#R1", "00000182#AA", "583#00", "083#FF00")
    assert desk.nmt.slaves[2].emergencies == [0x1031]
    assert spy.calls == ["182#3706", "583#00", "083#FF00"]


def test_sync_goes_out_from_the_start_and_pdos_with_it_once_operational() -> None:
    desk, spy = Desk(SlaveAssignment(2, mandatory=True), sync_us=10_000), Spy()
    desk.nmt.process_data = spy
    desk.at(0)
    assert desk.at(10_000) == ["080#"]
    assert spy.calls == ["after sync"]
    desk.at(11_000, f"582#{DEVICE_TYPE}")
    assert desk.at(20_000) == ["080#"]
    assert spy.calls == ["after sync", "sync", "after sync"]


def lost(**plan: Any) -> tuple[Desk, list[str]]:
    """Lose the mandatory one of two slaves."""
    slaves = (
        SlaveAssignment(2, mandatory=True, heartbeat_us=50_000),
        SlaveAssignment(3, heartbeat_us=90_000),
    )
    desk = Desk(*slaves, heartbeat_us=1_000_000, **plan)
    desk.at(0)
    desk.boot(3)
    desk.at(0, f"582#{DEVICE_TYPE}")
    desk.at(1_000, "702#7F", "703#7F")
    return desk, desk.at(51_000)


def test_a_lost_slave_is_reset_alone() -> None:
    desk, sent = lost()
    assert sent == ["000#8102"]
    assert desk.at(91_000) == ["000#8103"]
    assert desk.nmt.state is NmtState.OPERATIONAL


def test_a_slave_that_failed_to_boot_is_reset_when_its_heartbeats_end() -> None:
    desk = Desk(SlaveAssignment(3, device_type=1, heartbeat_us=90_000))
    desk.at(0, "703#00")
    desk.at(0, f"583#{DEVICE_TYPE}")
    assert desk.nmt.slaves[3].outcome is not None
    assert not desk.nmt.slaves[3].good
    assert desk.at(200_000, "703#7F") == []
    assert desk.at(290_000) == ["000#8103"]


def test_an_optional_slave_that_is_lost_is_reset_alone_whatever_mandatory_ones_cause() -> None:
    for plan in ({"resets_all": True}, {"stops_all": True}):
        desk = Desk(SlaveAssignment(3, heartbeat_us=90_000), **plan)
        desk.at(0)
        desk.boot(3)
        desk.at(1_000, "703#7F")
        assert desk.at(91_000) == ["000#8103"]


def test_a_lost_slave_may_stop_all_and_the_master() -> None:
    desk, sent = lost(stops_all=True)
    assert sent == ["000#0200"]
    assert desk.nmt.slaves[3].state is NmtState.STOPPED
    assert desk.at(1_000_000)[-1] == "701#04"


def test_a_lost_slave_may_reset_all_and_the_master_which_begins_anew() -> None:
    desk, sent = lost(resets_all=True)
    assert sent == ["000#8100"]
    assert desk.nmt.due_us == 51_000
    assert desk.at(51_000) == ["701#00", "000#8200", "602#4000100000000000"]
    assert desk.nmt.slaves[3].outcome is None
    assert desk.at(91_000) == []  # nobody watches it now
    assert not desk.nmt.halted


def test_of_a_slave_that_nobody_has_heard_nothing_is_known() -> None:
    slave = Desk(SlaveAssignment(2)).nmt.slaves[2]
    assert (slave.state, slave.outcome, slave.booting, slave.good) == (None, None, False, False)
    assert (slave.lost, slave.began_us, slave.due_us) == (0, 0, NEVER)
    assert (slave.steps, slave.events, slave.emergencies) == ([], [], [])


def test_a_slave_that_reports_boot_up_is_pre_operational() -> None:
    desk = Desk(SlaveAssignment(2))
    desk.at(0)
    desk.at(1_000, "702#00")
    assert desk.nmt.slaves[2].state is NmtState.PRE_OPERATIONAL


def told(desk: Desk) -> list[str]:
    return [str(step) for _, step in desk.nmt.slaves[2].events]


def test_a_guarded_slave_is_lost_each_time_it_falls_silent() -> None:
    desk = Desk(SlaveAssignment(2, guard_us=100_000, life_time_factor=3))
    desk.at(0)
    for begun_us in (0, 1_000_000):
        desk.now_us = begun_us
        assert desk.boot(2) == ["702#R1", "000#0102"]
        desk.at(begun_us, "702#05")
        assert desk.at(begun_us + 100_000) == ["702#R1"]
        desk.at(begun_us + 100_500, "702#85")
        assert desk.at(begun_us + 200_000) == ["702#R1"]
        desk.at(begun_us + 200_500, "702#84")  # not toggled: that is no answer
        assert desk.at(begun_us + 300_000) == ["702#R1"]
        assert desk.at(begun_us + 400_000) == ["000#8102"]
        assert desk.at(begun_us + 500_000) == ["702#R1"]  # and once only
    lost = "guarding: none within 300 ms; lost; reset node is sent, once"
    assert told(desk) == [lost, "boot-up: received; booting again", lost]


def test_the_events_of_a_slave_have_the_times_of_its_loss_and_its_return() -> None:
    desk, _ = lost()
    desk.at(200_000)
    desk.at(250_000, "702#7F")
    assert [at_us for at_us, _ in desk.nmt.slaves[2].events] == [51_000, 250_000]


def test_a_guarded_slave_that_never_answers_is_lost_as_often_as_it_boots() -> None:
    desk = Desk(SlaveAssignment(2, guard_us=100_000, life_time_factor=3))
    desk.at(0)
    for begun_us in (0, 1_000_000):
        desk.now_us = begun_us
        desk.boot(2)
        for late_us in (100_000, 200_000):
            assert desk.at(begun_us + late_us) == ["702#R1"]
        assert desk.at(begun_us + 300_000) == ["000#8102"]


def test_a_boot_time_is_over_when_it_is_over() -> None:
    desk = Desk(SlaveAssignment(2, mandatory=True), boot_time_us=400_000)
    desk.at(0)
    for now_us in (100_000, 200_000, 300_000):
        assert desk.at(now_us)[-1] == "602#4001100000000000"
    assert not desk.nmt.halted
    desk.at(400_000)
    assert desk.nmt.halted


def test_a_boot_up_that_all_are_reset_in_is_forgotten() -> None:
    slaves = SlaveAssignment(2, mandatory=True, heartbeat_us=50_000), SlaveAssignment(3)
    desk = Desk(*slaves, resets_all=True)
    desk.at(0)
    desk.at(0, f"582#{DEVICE_TYPE}")
    desk.at(1_000, "702#7F")
    assert desk.at(2_000, "703#00") == ["603#4000100000000000"]
    assert desk.at(51_000) == ["000#8100"]
    desk.at(51_000)
    assert desk.at(52_000, "703#00") == ["603#4001100000000000"]
    assert desk.at(53_000, "583#4F01100000000000") == ["603#4000100000000000"]
