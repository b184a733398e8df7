"""A chair under a guard, in virtual time."""

from __future__ import annotations

import pytest

from tests.host.rigs import ScriptedLink
from tests.host.rrc.chair_bench import Bench
from tests.host.spy_link import SpyLink
from tickrig.device.rrc.machine import Rrc
from tickrig.emulators.rig.faults import FaultyPort
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.sim_link import SimLink
from tickrig.emulators.rig.station import Station
from tickrig.emulators.serial.byte_faults import BYTE_FAULTS
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.host.links.link import LinkTimeout
from tickrig.host.rrc.chair import DEAD_MAN_US, Chair, ChairStopped, DeadMan, Guard, NotAnRrc
from tickrig.wire.rrc.commands import BadParameters, Limit


def drive(bench: Bench, v_pct: int = 30) -> None:
    """Drive for 2 s, and stop."""
    with bench.chair as chair:
        chair.take_over()
        for _ in range(100):
            chair.drive(v_pct, 0)


def drive_too_fast(bench: Bench, chair: Chair) -> None:
    chair.take_over()
    chair.drive(30, 0)
    assert bench.out_pct() == (30, 0)
    chair.drive(101, 0)


def lose_power(bench: Bench, chair: Chair) -> None:
    chair.take_over()
    bench.rrc.inputs.set("rrc_power", 0)
    for _ in range(100):
        chair.drive(30, 0)


def test_the_guard_is_set_before_anything_moves() -> None:
    bench = Bench()
    assert bench.link.lines[-2:] == [b"watchdog32", b"stablemode1"]
    assert (bench.chair.client.watchdog_us, bench.chair.client.stable) == (500_000, True)


class LateLink(SpyLink):
    """An RRC whose answers come after half a second, to commands of some numbers."""

    def __init__(self, late: range, delay: str = "500ms") -> None:
        line = SerialLine()
        self._port, self._late, self._delay = FaultyPort(line.a, BYTE_FAULTS), late, delay
        super().__init__(SimLink(Rig(Station(Rrc(), self._port)), line.b))

    def send(self, traffic: bytes, /) -> None:
        if len(self.lines) in self._late:
            self._port.arm("delay", self._delay)
        else:
            self._port.clear("delay")
        super().send(traffic)


def test_an_rrc_that_answers_late_is_asked_again() -> None:
    with Chair(LateLink(range(1, 2)), Guard()) as chair:
        assert chair.client.stable


def test_an_rrc_that_always_answers_late_is_not_taken_for_another_device() -> None:
    with pytest.raises(LinkTimeout, match="an RRC answered once, then not in time: "):
        Chair(LateLink(range(1, 99), "9s"), Guard())


def listen(bench: Bench, duration_us: int) -> None:
    for _ in range(duration_us // 20_000):
        bench.chair.client.run_for(20_000)
        assert bench.chair.watch() == []


def test_an_rrc_that_is_gone_while_vr2_is_off_is_noticed_within_two_seconds() -> None:
    bench = Bench(on=False)
    bench.chair.status()
    listen(bench, 4_000_000)  # VR2 off is no failure
    bench.rrc.inputs.set("rrc_power", 0)
    with pytest.raises(LinkTimeout, match="is the RRC still there"):
        listen(bench, 2_000_000)


def test_without_a_guard_nothing_is_set() -> None:
    bench = Bench(Guard(0, stable=False))
    assert set(bench.link.lines) == {b"\ndevice", b"device"}


def test_the_end_stops_the_motors_and_leaves_the_rrc_as_it_was_found() -> None:
    bench = Bench()
    with bench.chair as chair:
        chair.take_over(speed_mode=2)
        chair.drive(30, -10)
        assert bench.out_pct() == (30, -10)
    assert bench.out_pct() == (0, 0)
    bench.rig.run_for(3_000_000)
    assert bench.rrc.read("state") == "Output"  # no watchdog is left


def test_stablemode_that_was_on_stays_on() -> None:
    bench = Bench()
    bench.chair.client.status()
    found = Chair(bench.link, Guard())
    with found:
        pass
    assert found.client.stable


def test_what_the_program_raises_stops_the_motors_too() -> None:
    bench = Bench()
    with pytest.raises(BadParameters), bench.chair as chair:
        drive_too_fast(bench, chair)
    assert bench.out_pct() == (0, 0)


def test_a_stick_that_drives_is_stopped_in_the_slowest_mode() -> None:
    bench = Bench()
    bench.rrc.inputs.set("stick_v_pct", 100)
    with bench.chair as chair:
        chair.drive_by_stick(Limit(50, 50), speed_mode=4)
        chair.client.run_for(100_000)
        assert bench.out_pct() == (50, 0)
    assert bench.out_pct() == (0, 0)
    assert (bench.rrc.read("state"), bench.rrc.read("speed_mode")) == ("Output", 1)


def test_a_stop_that_is_not_confirmed_switches_vr2_off() -> None:
    bench = Bench()
    with bench.chair as chair:
        chair.take_over()
        chair.drive(30, 0)
        bench.link.spoil = lambda line: b"" if line.startswith(b"output") else line
    assert bench.rrc.read("state") == "PowerOffByOthers"


def test_an_output_that_is_another_one_switches_vr2_off() -> None:
    bench = Bench()
    said = "commanded 30 0, the RRC drives 0 0: VR2 switched off"
    bench.link.spoil = lambda line: b"" if line.startswith(b"output1e") else line
    with pytest.raises(ChairStopped, match=said):
        drive(bench)
    assert bench.rrc.read("state") == "PowerOffByOthers"


def test_a_vr2_that_is_off_is_said() -> None:
    with pytest.raises(ChairStopped, match="VR2 is off"), Bench(on=False).chair as chair:
        chair.require_on()


def test_an_event_ends_the_drive_with_its_name() -> None:
    bench = Bench()
    bench.rrc.inputs.set("vr2_fault", 1)
    with pytest.raises(ChairStopped, match="VR2 was stopped: EV:PowerOffWaitBySystemError"):
        drive(bench)


def test_an_rrc_that_falls_silent_ends_the_drive() -> None:
    bench = Bench()
    with pytest.raises(LinkTimeout, match="no status line for 300 ms"), bench.chair as chair:
        lose_power(bench, chair)


def test_another_device_is_quoted() -> None:
    link = ScriptedLink({b"\ndevice": [b"0D\n00P\n\n"]})
    with pytest.raises(NotAnRrc, match=r"no RRC: b'0D.n00P.n.n' came"):
        Chair(link, Guard())
    assert set(link.sent) == {b"\ndevice", b"device"}


def test_silence_is_said() -> None:
    with pytest.raises(LinkTimeout, match="no answer: is an RRC connected"):
        Chair(ScriptedLink(), Guard())


def test_a_dead_man_key_holds_for_a_second() -> None:
    key = DeadMan()
    assert not key.holds(0)
    key.press(100)
    assert key.holds(100 + DEAD_MAN_US - 1)
    assert not key.holds(100 + DEAD_MAN_US)
    key.press(100)
    key.release()
    assert not key.holds(100)
