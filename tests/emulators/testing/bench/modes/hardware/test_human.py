"""A bench whose operator is a human: what is asked, and what comes of the answers."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from tests.emulators.testing.bench.modes.hardware.plans import Answers, serial_plan
from tickrig import Bench
from tickrig.emulators.record.replay import read_bench_recording
from tickrig.emulators.testing.bench.errors import (
    BenchBlocked,
    NotOnThisBench,
    OperatorRefused,
    PortGone,
)
from tickrig.emulators.testing.bench.modes.operators import Terminal
from tickrig.emulators.testing.rig_file.plan import (
    HardwarePlan,
    PortPlan,
    PowerPlan,
    RigPlan,
    Tolerances,
)
from tickrig.host.text.trace import Mark

HOW = "then press Enter (n: not done, c: cannot be done):"


BenchOf = Callable[..., Bench]


@pytest.fixture
def bench_of() -> Iterator[BenchOf]:
    """Opens a bench of an RRC with a human at the terminal."""
    with ExitStack() as stack:

        def bench_of(terminal: Terminal, hardware: HardwarePlan | None = None) -> Bench:
            plan = serial_plan(hardware or HardwarePlan())
            return stack.enter_context(Bench.of_plan(plan, "hardware", terminal))

        yield bench_of


def test_a_button_is_pressed_by_the_words_of_its_table(bench_of: BenchOf) -> None:
    human = Answers("", "")
    bench = bench_of(human)
    bench.press("power_button")
    bench.press("alarm_button", for_="2s")
    assert human.asked == [
        f"rrc: press the power button of the controller and let it go, {HOW}",
        f"rrc: press the alarm button of the controller, hold it for 2 s and let it go, {HOW}",
    ]
    assert "rrc ! power_button pressed for 0.1 s" in bench.transcript()


def test_a_group_is_set_at_once_and_remembered(bench_of: BenchOf) -> None:
    human = Answers("")
    bench = bench_of(human)
    bench.set("stick", 100, -20)
    (asked,) = human.asked
    assert "set stick_v_pct (stick, forward is positive) to 100 %" in asked
    assert "and set stick_w_pct (stick, right is positive) to -20 %, and leave it so" in asked
    assert (bench.get("stick_v_pct"), bench.get("stick_w_pct")) == (100, -20)
    assert "rrc ! stick=100 -20" in bench.transcript()


def test_what_a_rig_file_has_at_the_start_is_asked_for() -> None:
    plan = serial_plan(HardwarePlan())
    device = replace(plan.devices["rrc"], start={"stick_v_pct": 20, "bus_unplugged": 1})
    human = Answers("")
    with Bench.of_plan(replace(plan, devices={"rrc": device}), "hardware", human) as bench:
        (asked,) = human.asked
        assert asked == (
            "rrc: set stick_v_pct (stick, forward is positive) to 20 % and make this fault: "
            f"a connector of the VR2 bus is out, and leave it so, {HOW}"
        )
        assert (bench.get("stick_v_pct"), bench.get("bus_unplugged")) == (20, 1)
        assert "rrc ! stick_v_pct=20, bus_unplugged=1" in bench.transcript()
    with pytest.raises(OperatorRefused, match="did not do this: rrc: set stick_v_pct"):
        Bench.of_plan(replace(plan, devices={"rrc": device}), "hardware", Answers("n"))


def test_what_was_done_by_hand_is_in_the_trace(bench_of: BenchOf, tmp_path: Path) -> None:
    bench = bench_of(Answers("", "", "", "", ""))
    bench.set("stick", 100, -20)
    bench.fault("bus_unplugged")
    bench.clear("bus_unplugged")
    bench.switch_on()
    bench.press("power_button", for_="1us")
    bench.save_trace(tmp_path / "run.trace")
    recording = read_bench_recording((tmp_path / "run.trace").read_bytes())
    assert (recording.at_port, recording.ended) == (True, True)
    assert recording.header.devices["rrc"].type == "rrc"
    assert [(x.name, x.text) for x in recording.records if x.mark is Mark.PHYSICAL] == [
        ("rrc", "stick_v_pct=100"),
        ("rrc", "stick_w_pct=-20"),
        ("rrc", "bus_unplugged=1"),
        ("rrc", "bus_unplugged=0"),
        ("rrc", "reset"),
        ("rrc", "power_button=1"),
        ("rrc", "power_button=0"),
    ]


def test_an_output_is_asked_for_until_it_is_a_number(bench_of: BenchOf) -> None:
    human = Answers("", "fast", "30", "Output")
    bench = bench_of(human)
    assert bench.get("out_v_pct") == 30
    assert bench.get("state") == "Output"
    assert human.asked[2] == "rrc: what is out_v_pct now in %? (translation to the power module)"


def test_a_fault_that_a_hand_can_make_is_made_and_mended(bench_of: BenchOf) -> None:
    human = Answers("", "")
    bench = bench_of(human)
    bench.fault("bus_unplugged")
    assert bench.get("bus_unplugged") == 1
    bench["rrc"].clear("bus_unplugged")
    assert bench.get("bus_unplugged") == 0
    assert human.asked[0].startswith(
        "rrc: make this fault: a connector of the VR2 bus is out (bus_unplugged), then"
    )


@pytest.mark.parametrize(
    ("spec", "options", "text"),
    [
        ("cut", {}, "no hand can make cut: it changes what passes on the wire"),
        ("bus_unplugged@2s-3s", {}, "no hand makes bus_unplugged at a certain time"),
        ("bus_unplugged", {"for_": "1s"}, "no hand makes bus_unplugged at a certain time"),
        ("bus_unplugged", {"when": lambda: True}, "the moment that something is so"),
    ],
)
def test_what_no_hand_can_do_is_told(
    bench_of: BenchOf, spec: str, options: dict[str, Any], text: str
) -> None:
    with pytest.raises(NotOnThisBench, match=text):
        bench_of(Answers()).fault(spec, **options)


def test_what_a_human_cannot_do_is_not_on_this_bench(bench_of: BenchOf) -> None:
    with pytest.raises(NotOnThisBench, match="cannot do this: rrc: make this fault: noise on"):
        bench_of(Answers("what?", "c")).fault("bus_noise")


def test_who_says_no_has_refused(bench_of: BenchOf) -> None:
    with pytest.raises(OperatorRefused, match="did not do this: rrc: press the power button"):
        bench_of(Answers("N")).press("power_button")


def test_what_is_seen_counts_however_late_the_machine_was(bench_of: BenchOf) -> None:
    human = Answers("maybe", "y", "n")
    bench = bench_of(human)
    assert bench.observe("the motors drive forward at 30 %", lambda: False)
    bench._mode._pace.waited(0, 80_000)  # type: ignore[attr-defined]
    assert (
        bench._mode.too_slow()
        == "the machine was too slow: host up to 80 ms, emulator up to 0 ms late"
    )
    assert not bench.observe("the motors stand still", lambda: True)
    assert bench._mode.too_slow() == ""
    assert human.asked[-1] == "rrc: is it so? the motors stand still [y/n]"
    assert "rrc ! not seen: the motors stand still" in bench.transcript()


def test_power_is_switched_by_hand_or_by_command(bench_of: BenchOf, tmp_path: Path) -> None:
    human = Answers("")
    bench = bench_of(human)
    bench.switch_off()
    assert human.asked[0].startswith("rrc: switch it off, then")
    bench = bench_of(Answers(), switched(tmp_path, "on", "off"))
    assert [path.name for path in tmp_path.iterdir()] == ["off"]
    bench.run_for("1ms")
    assert {path.name for path in tmp_path.iterdir()} == {"off", "on"}
    (tmp_path / "off").unlink()
    bench["rrc"].switch_off()
    assert (tmp_path / "off").exists()


def test_what_a_test_has_switched_off_stays_off(bench_of: BenchOf, tmp_path: Path) -> None:
    bench = bench_of(Answers(), switched(tmp_path, "on", "off"))
    bench.switch_off()
    bench.run_for("1ms")
    assert [path.name for path in tmp_path.iterdir()] == ["off"]


def switched(folder: Path, on: str, off: str) -> HardwarePlan:
    """An RRC that is switched by commands, each of which makes a file."""
    program = "import sys; open(sys.argv[1], 'w')"
    commands = ((sys.executable, "-c", program, str(folder / name)) for name in (on, off))
    return HardwarePlan(power={"rrc": PowerPlan(on=next(commands), off=next(commands))})


def test_a_command_that_fails_says_nothing_of_the_device(bench_of: BenchOf, tmp_path: Path) -> None:
    with pytest.raises(BenchBlocked, match=r"rrc was not switched off: .*: exit status 1: .*/no/"):
        bench_of(Answers(), switched(tmp_path, "on", "no/file"))
    missing = PowerPlan(on=("/no",), off=("/no",))
    with pytest.raises(BenchBlocked, match="rrc was not switched off: /no: No such file"):
        bench_of(Answers(), HardwarePlan(power={"rrc": missing}))


@pytest.mark.parametrize(
    ("act", "text"),
    [
        (lambda bench: bench.set("stik", 1), "no input 'stik'; did you mean 'stick'?"),
        (lambda bench: bench.set("stick", 1), "stick takes 2 values"),
        (lambda bench: bench.get("nothing"), "no input or output 'nothing'; known: "),
        (lambda bench: bench.press("state"), "no button 'state'; known: .*power_button"),
        (lambda bench: bench.fault("smoke"), "no fault 'smoke'; known: .*cut"),
        (lambda bench: bench.can_bus(), "no address of rrc is given"),
    ],
)
def test_what_cannot_be_is_told(bench_of: BenchOf, act, text: str) -> None:  # type: ignore[no-untyped-def]
    with pytest.raises((ValueError, NotOnThisBench), match=text):
        act(bench_of(Answers()))


def test_what_real_devices_cannot_do_is_told(bench_of: BenchOf) -> None:
    bench = bench_of(Answers())
    with pytest.raises(NotOnThisBench, match="real devices have no twins"):
        bench.fork()
    with pytest.raises(NotOnThisBench, match="on emulated devices alone"):
        bench.start(bench.sleep("1ms"))
    bench.run(bench.sleep("1ms"))
    assert "power_button" in bench.describe().buttons


def test_a_rig_file_says_what_is_still_right(bench_of: BenchOf) -> None:
    tolerance = Tolerances(stick_pct=7, time_us=20_000, values={"gauge": 1})
    assert bench_of(Answers(), HardwarePlan(tolerance=tolerance)).tolerance is tolerance


def test_a_rig_file_without_hardware_is_told() -> None:
    with pytest.raises(ValueError, match=r"the rig file has no \[hardware\]"):
        Bench.of_plan(RigPlan(), "hardware")


def test_a_port_that_is_not_there_says_nothing_of_the_device(bench_of: BenchOf) -> None:
    ports = {"rrc": PortPlan(port="/dev/no-such-port")}
    with bench_of(Answers(), HardwarePlan(ports=ports)) as bench:
        with pytest.raises(PortGone, match="'/dev/no-such-port': No such file or directory"):
            _ = bench.link
        with pytest.raises(PortGone, match="'/dev/no-such-port': No such file or directory"):
            bench.serial()


def test_an_emulator_that_is_not_there_is_told(bench_of: BenchOf, tmp_path: Path) -> None:
    control = {"rrc": tmp_path / "ctl"}
    with pytest.raises(PortGone, match=r"rrc: no emulator at .*ctl: No such file"):
        bench_of(Answers(), HardwarePlan(control=control))


def test_what_is_more_than_one_act_is_told_in_words(bench_of: BenchOf) -> None:
    human = Answers("")
    bench = bench_of(human)
    bench.perform("switch VR2 off, unless it is off", lambda: bench.press("power_button"))
    assert human.asked == [f"rrc: switch VR2 off, unless it is off, {HOW}"]
    assert "rrc ! done: switch VR2 off, unless it is off" in bench.transcript()


def test_no_terminal_is_nobody_there(bench_of: BenchOf, tmp_path: Path) -> None:
    bench = bench_of(Terminal(str(tmp_path)))
    with pytest.raises(OperatorRefused, match=r"there is no terminal \(Is a directory\)"):
        bench.press("power_button")
