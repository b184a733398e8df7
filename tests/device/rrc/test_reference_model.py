"""The naive model against every golden vector of the digest, by itself."""

import json
import math
from pathlib import Path
from typing import Any

import pytest

from tests.device.rrc.reference_model import FAULTS, INPUTS, ReferenceRrc, check, limited, shape

VECTORS: dict[str, list[dict[str, Any]]] = json.loads(
    (Path(__file__).parents[2] / "golden" / "rrc.json").read_text(encoding="utf-8")
)
FAULT_OF_CAUSE = {cause: name for name, cause in FAULTS}


def by_id(kind: str, prefix: str = "") -> list[Any]:
    return [pytest.param(v, id=v["id"]) for v in VECTORS[kind] if v["id"].startswith(prefix)]


class Bench:
    """A model with its clock and its physical inputs."""

    def __init__(self) -> None:
        self.model = ReferenceRrc()
        self.inputs = dict(INPUTS)
        self.now = 0

    def tick(self, *lines: str, **inputs: int) -> list[str]:
        self.inputs.update(inputs)
        self.now += 1
        rx = "".join(line + "\n" for line in lines).encode()
        return self.raw(rx)

    def raw(self, rx: bytes) -> list[str]:
        return self.model.tick(self.now, rx, self.inputs).decode().splitlines()

    def ticks(self, count: int, **inputs: int) -> list[str]:
        found = self.tick(**inputs)
        for _ in range(count - 1):
            found += self.tick()
        return found

    def press_power(self) -> list[str]:
        return self.tick(power_button=1) + self.tick(power_button=0)

    def standby(self) -> "Bench":
        self.tick()
        self.press_power()
        self.ticks(29)
        assert self.model.state == "Standby"
        return self


def prepared(vector: dict[str, Any]) -> Bench:
    bench = Bench()
    kind = vector["id"]
    if kind in ("D01", "D02", "D03", "D04"):
        bench.tick()
        return bench
    bench.standby()
    if "stablemode on" in vector["note"] or kind == "G04":
        bench.tick("stablemode1")
    if kind == "D07":
        bench.tick("poweroff")
    if kind.startswith("E"):
        prepare_status(bench, kind)
    return bench


def prepare_status(bench: Bench, kind: str) -> None:
    bench.tick("statusA1")
    if kind == "E02":
        bench.tick("limit3232ffffff", stick_v_pct=100)
    elif kind == "E03":
        bench.tick("output1e00", stick_v_pct=-100, stick_w_pct=37)
    elif kind == "E04":
        # No session gets there: the alarm button in Standby would let the stick drive.
        bench.model.speed_mode = 4
        bench.model.counters = {"speed_up_button": 15, "speed_down_button": 2, "alarm_button": 10}
        bench.inputs.update(speed_up_button=1, gauge=3, stick_v_pct=-1, stick_w_pct=100)
    elif kind == "E05":
        bench.inputs.update(stick_v_pct=-100, stick_w_pct=-100)


@pytest.mark.unmeasured
@pytest.mark.parametrize("vector", by_id("lines"))
def test_lines_are_answered(vector: dict[str, Any]) -> None:
    bench = prepared(vector)
    # Outside S3..S5 one line is taken in an even tick; the vectors show one line a tick.
    idle = vector["id"] in ("D01", "D02", "D03", "D04", "D07")
    for step in vector["steps"]:
        lines = [] if step["host"] is None else [step["host"]]
        replies = bench.tick(*lines)
        if idle:
            replies += bench.tick()
        assert replies == step["rrc"]
    assert bench.model.state == vector["state"]


def act(bench: Bench, name: str) -> list[str]:
    name, _, cause = name.partition(":")
    if name == "power":
        return bench.tick()
    if name == "vr2_on":
        return vr2_on(bench, cause)
    if name == "vr2_button_off":
        return bench.press_power()
    if name == "force_off":
        return force_off(bench, cause)
    assert name == "vr2_stopped"
    if bench.model.state == "PowerOffByButton":
        return bench.ticks(50)
    return bench.press_power() + bench.ticks(10)


def vr2_on(bench: Bench, cause: str) -> list[str]:
    fault = {"": "", "Error1": "bus_noise", "Error2": "vr2_fault", "Timeout": "bus_unplugged"}[
        cause
    ]
    if not fault:
        return bench.press_power() + bench.ticks(29)
    found = bench.tick(**{fault: 1}) + bench.press_power() + bench.ticks(299)
    return found + bench.tick(**{fault: 0})


def force_off(bench: Bench, cause: str) -> list[str]:
    if cause in FAULT_OF_CAUSE:
        found = bench.ticks(11, **{FAULT_OF_CAUSE[cause]: 1})
        return found + bench.tick(**{FAULT_OF_CAUSE[cause]: 0})
    if cause == "Host":
        bench.tick("stablemode1")
        return bench.tick("poweroff8")
    if cause == "Watchdog":
        bench.tick("stablemode1")
        return bench.tick("watchdog03" + check(b"watchdog03")) + bench.ticks(3)
    assert cause == "OverTime"
    return bench.ticks(30, extra_load_pct=80) + bench.tick(extra_load_pct=0)


@pytest.mark.parametrize("vector", by_id("power"))
def test_power_sequences_give_their_events(vector: dict[str, Any]) -> None:
    bench = Bench()
    for step in vector["acts"]:
        replies = act(bench, step["act"])
        # The vector counts the next EV:Initialized to the act; it is sent one tick later.
        if step["act"] == "vr2_stopped":
            replies += bench.tick()
        assert replies == step["rrc"]
        assert bench.model.state == step["state"]


@pytest.mark.parametrize(
    "vector", [vector for vector in by_id("load") if " command" in vector.values[0]["note"][:11]]
)
def test_load_stops_the_device_in_its_tick(vector: dict[str, Any]) -> None:
    bench = Bench().standby()
    note = vector["note"]
    count = int(note[0])
    line = "output0000"
    if "SA on" in note:
        bench.tick("statusA1")
    if "stablemode" in note:
        bench.tick("stablemode1")
        line += check(line.encode())
    bench.ticks(3)
    for tick in range(vector["tick"] + 1):
        bad = [r for r in bench.tick(*[line] * count) if r[:3] == "ER:" or r[:3] == "EV:"]
        assert bad == (vector["first"] if tick == vector["tick"] else [])
    assert bench.model.state == vector["state"]


def test_noise_that_is_thrown_away_stops_the_device() -> None:
    (vector,) = [v for v in VECTORS["load"] if v["id"] == "T09"]
    bench = Bench().standby()
    bench.tick("statusA1")
    bench.ticks(3)
    for tick in range(vector["tick"] + 1):
        bench.now += 1
        events = [line for line in bench.raw(b"x" * 115) if line.startswith("EV")]
        assert events == (vector["first"] if tick == vector["tick"] else [])


def test_overflow_drops_the_buffer_up_to_the_next_line() -> None:
    (vector,) = [v for v in VECTORS["load"] if v["id"] == "T06"]
    bench = Bench().standby()
    for rx, replies in zip([b"x" * 115] * 3 + [b"\ndevice\n"], vector["per_tick"], strict=True):
        bench.now += 1
        assert bench.raw(rx) == replies


@pytest.mark.parametrize("vector", VECTORS["limit"])
def test_limits(vector: dict[str, Any]) -> None:
    v, w = vector["stick"]
    assert limited(v, w, vector["limit"]) == tuple(vector["out"])


@pytest.mark.parametrize("vector", VECTORS["shape"])
def test_shaping(vector: dict[str, Any]) -> None:
    assert shape(vector["in"], vector["low"], vector["high"], vector["n"]) == vector["out"]


def in_limit_mode(mode: int) -> Bench:
    bench = Bench().standby()
    bench.tick(f"joystick0000646400{mode}051e2d", "limit6464ffffff")
    assert bench.model.state == "Limit"
    return bench


@pytest.mark.parametrize("vector", VECTORS["reverse"])
def test_reverse_modes(vector: dict[str, Any]) -> None:
    bench = in_limit_mode(vector["mode"])
    v, w = vector["stick"]
    bench.tick(stick_v_pct=v, stick_w_pct=w)
    assert [bench.model.out_v, bench.model.out_w] == vector["out"]
    assert bench.model.gear == (vector["gear"] or "N")


def test_gear_walk_in_mode_3() -> None:
    bench = in_limit_mode(3)
    for vector in VECTORS["gear_walk_mode3"]:
        v, w = vector["stick"]
        bench.ticks(vector["ticks"], stick_v_pct=v, stick_w_pct=w)
        assert bench.model.gear == vector["gear"]
        assert [bench.model.out_v, bench.model.out_w] == vector["out"]


@pytest.mark.unmeasured
def test_float_noise_of_r16_never_decides_against_the_exact_value() -> None:
    for span in range(1, 101):
        for part in range(1, span):
            if math.gcd(part, span) > 1:
                continue
            for exponent in range(16):
                noisy = int(100 * (part / span) ** (1 + 0.1 * exponent) + 0.5 + 1e-9)
                assert shape(part, 0, span, exponent) == noisy
