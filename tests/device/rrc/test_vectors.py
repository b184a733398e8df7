"""The golden vectors (tests/golden/rrc.json), played against the device."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.device.rrc.bench import RrcBench
from tickrig.device.rrc.drive import Gearbox, apply_limits, shape
from tickrig.wire.rrc.commands import Joystick, Limit

VECTORS: dict[str, list[dict[str, Any]]] = json.loads(
    (Path(__file__).parents[2] / "golden" / "rrc.json").read_text("utf-8")
)

# What the notes of the dialogues say in words: state to begin in, physical inputs.
BEGIN = {"D01": "WaitPowerOn", "D02": "WaitPowerOn", "D03": "WaitPowerOn", "D04": "WaitPowerOn"}
BEGIN |= {"D07": "PowerOffByOthers"}
STATUS_ON = {"E01", "E02", "E03", "E04", "E05", "E06"}
STABLE = {row["id"] for row in VECTORS["lines"] if "stablemode on" in row["note"]} | {"G04"}

CAUSES = {
    "CommunicationError": "bus_noise",
    "JoystickModuleError": "joystick_fault",
    "PowerModuleError": "power_module_fault",
    "SystemError": "vr2_fault",
    "NoCommunication": "bus_unplugged",
}
POWER_ON_CAUSES = {
    "Error1": "joystick_fault",
    "Error2": "power_module_fault",
    "Timeout": "bus_unplugged",
}


def ids(rows: list[dict[str, Any]]) -> list[str]:
    return [row["id"] for row in rows]


def prepare(row: dict[str, Any]) -> RrcBench:
    bench = RrcBench().enter(BEGIN.get(row["id"], "Standby"))
    match row["id"]:
        case "E02":
            bench.set(stick_v_pct=100)
            bench.step("limit3232ffffff")
        case "E03":
            bench.set(stick_v_pct=-100, stick_w_pct=0x25)
            bench.step("output1e00")
        case "E04":
            bench.step("speedmode41")  # locked: the buttons below change counters only
            press(bench, "speed_up_button", 15)
            press(bench, "speed_down_button", 2)
            press(bench, "alarm_button", 10)
            bench.set(stick_v_pct=-1, stick_w_pct=100, gauge=3)
            bench.rrc._settings.button_mode = None  # what alarm presses chose is not meant here
        case "E05":
            bench.set(stick_v_pct=-100, stick_w_pct=-100)
    if row["id"] in STATUS_ON:
        bench.step("statusA1")
    if row["id"] in STABLE:
        bench.step("stablemode1")
    bench.align()
    return bench


def press(bench: RrcBench, button: str, edges: int) -> None:
    for edge in range(edges):
        bench.set(**{button: (edge + 1) % 2})
        bench.step()


@pytest.mark.parametrize("row", VECTORS["lines"], ids=ids(VECTORS["lines"]))
def test_dialogue(row: dict[str, Any]) -> None:
    bench = prepare(row)
    for step in row["steps"]:
        lines = [] if step["host"] is None else [step["host"]]
        assert bench.step(*lines) == step["rrc"]
    assert bench.state == row["state"]


def act(bench: RrcBench, action: str) -> list[str]:
    name, _, cause = action.partition(":")
    match name:
        case "power":
            return bench.step()
        case "vr2_on":
            fault = POWER_ON_CAUSES.get(cause)
            if fault:
                bench.set(**{fault: 1})
            lines = bench.tap("power_button") + bench.run(300)
            if fault:
                bench.set(**{fault: 0})
            return lines
        case "vr2_button_off":
            return bench.tap("power_button")
        case "vr2_stopped":
            pressed = bench.tap("power_button") if bench.state == "PowerOffByOthers" else []
            return pressed + bench.run(60)
        case _:
            return force_off(bench, cause)


def force_off(bench: RrcBench, cause: str) -> list[str]:
    match cause:
        case "Host":
            return [line for line in bench.step("poweroff") if line != "OK:poweroff"]
        case "Watchdog":
            assert bench.step("watchdog05") == ["OK:watchdog"]
            return bench.run(5)
        case "OverTime":
            bench.set(extra_load_pct=400)
        case _:
            bench.set(**{CAUSES[cause]: 1})
    lines = bench.run(11)
    bench.set(extra_load_pct=0, **dict.fromkeys(CAUSES.values(), 0))
    return lines


@pytest.mark.unmeasured
@pytest.mark.parametrize("row", VECTORS["power"], ids=ids(VECTORS["power"]))
def test_power_sequence(row: dict[str, Any]) -> None:
    bench = RrcBench()
    for step in row["acts"]:
        assert act(bench, step["act"]) == step["rrc"]
        assert bench.state == step["state"]


LOADS = {
    "T01": (2, False, True),
    "T02": (2, False, False),
    "T03": (2, True, True),
    "T04": (1, False, True),
    "T05": (3, True, True),
    "T07": (8, True, True),
    "T08": (4, True, False),
}
LOAD = {row["id"]: row for row in VECTORS["load"]}


@pytest.mark.parametrize("row", [LOAD[key] for key in LOADS], ids=LOADS)
def test_load(row: dict[str, Any]) -> None:
    commands, stable, status = LOADS[row["id"]]
    bench = RrcBench().enter("Output")
    if stable:
        bench.step("stablemode1")
    if status:
        bench.step("statusA16" if stable else "statusA1")
    bench.run(1)
    line = "output00001" if stable else "output0000"
    for tick in range(row["tick"] + 1):
        sent = bench.step(*[line] * commands)
        loud = [text for text in sent if text.startswith(("ER", "EV"))]
        assert loud == (row["first"] if tick == row["tick"] else [])
    assert bench.state == row["state"]


def test_line_feed_ends_an_overflow() -> None:
    row = LOAD["T06"]
    bench = RrcBench().enter("Standby")
    noise = b"x" * 115
    sent = [bench.step(raw=data) for data in (noise, noise, noise, b"\ndevice\n")]
    assert sent == row["per_tick"]


def test_noise_that_is_thrown_away_stops_vr2() -> None:
    row, bench = LOAD["T09"], RrcBench().enter("Standby")
    bench.step("statusA1")
    bench.run(1)
    for tick in range(row["tick"] + 1):
        events = [text for text in bench.step(raw=b"x" * 115) if text.startswith("EV")]
        assert events == (row["first"] if tick == row["tick"] else [])
    assert bench.state == row["state"]


@pytest.mark.parametrize("row", VECTORS["limit"])
def test_limits(row: dict[str, Any]) -> None:
    v_pct, w_pct = row["stick"]
    assert list(apply_limits(v_pct, w_pct, Limit(*row["limit"]))) == row["out"]


@pytest.mark.parametrize("row", VECTORS["shape"])
def test_shaping(row: dict[str, Any]) -> None:
    assert shape(row["in"], row["low"], row["high"], row["n"]) == row["out"]


@pytest.mark.parametrize("row", VECTORS["reverse"])
def test_reverse_mode(row: dict[str, Any]) -> None:
    gearbox, stick = Gearbox(), (row["stick"][0], row["stick"][1])
    out = gearbox.drive(1, row["mode"], stick, stick, Joystick())
    assert list(out) == row["out"]
    assert gearbox.gear.value == (row["gear"] or "N")


def test_gear_walk() -> None:
    bench = RrcBench().enter("Limit")
    bench.step("joystick00006464003051e2d")
    bench.step("speedmode10")
    for row in VECTORS["gear_walk_mode3"]:
        bench.set(stick_v_pct=row["stick"][0], stick_w_pct=row["stick"][1])
        bench.run(row["ticks"])
        assert bench.rrc.read("gear") == row["gear"], row
        assert [bench.rrc.read("out_v_pct"), bench.rrc.read("out_w_pct")] == row["out"], row
