"""Random sessions against the device and the naive model, compared tick by tick.

`python -m tests.device.rrc.test_against_reference 100000 [SEED]` plays that many ticks.
"""

import random
import sys
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.device.rrc.reference_model import INPUTS, NAMES, ReferenceRrc, check
from tests.soak import examples
from tickrig.device.rrc.machine import Rrc

pytestmark = pytest.mark.unmeasured

TICK_US = 10_000
FAULTS = ("bus_noise", "joystick_fault", "power_module_fault", "vr2_fault", "bus_unplugged")
BUTTONS = ("power_button", "alarm_button", "speed_up_button", "speed_down_button")
SHOWN = (
    *("state", "gear", "buzzer", "out_v_pct", "out_w_pct", "speed_mode"),
    *("load_pct", "margin_pct", "backlog_pct", "pace_lines_s"),
)
PERCENTS = (-100, -99, -60, -50, -45, -30, -10, -5, -4, -3, -1, 0, 1, 3, 4, 5, 10, 50, 99, 100)
# Limits, dead zones and angles at and around the ends of their ranges.
BYTES = (0, 1, 5, 10, 30, 45, 50, 89, 90, 91, 99, 100, 101, 127, 128, 155, 156, 200, 254, 255)


@dataclass(frozen=True, slots=True)
class Step:
    """What reaches the device in one tick: bytes and the inputs that changed."""

    rx: bytes
    changes: tuple[tuple[str, int], ...] = ()


@dataclass(frozen=True, slots=True)
class Line:
    """One line of the host; CHECK is added while the model wants it, if `checked`."""

    text: bytes
    checked: bool = True
    end: bytes = b"\n"

    def encode(self, stable: bool) -> bytes:
        digit = check(self.text).encode() if stable and self.checked else b""
        return self.text + digit + self.end


@dataclass(frozen=True, slots=True)
class Act:
    """Lines and changed inputs, held for some ticks; the lines come once, each tick or in bits."""

    lines: tuple[Line, ...] = ()
    changes: dict[str, int] = field(default_factory=dict)
    ticks: int = 1
    repeat: bool = False
    chunk: int = 0

    def steps(self, stable: bool) -> Iterator[Step]:
        rx = b"".join(line.encode(stable) for line in self.lines)
        changes = tuple(self.changes.items())
        if self.chunk and rx:
            for at in range(0, len(rx), self.chunk):
                yield Step(rx[at : at + self.chunk], changes if at == 0 else ())
            return
        for i in range(self.ticks):
            yield Step(rx if i == 0 or self.repeat else b"", changes if i == 0 else ())


class Pair:
    """The model and two devices, one ticked always and one only when it is due."""

    def __init__(self) -> None:
        self.model = ReferenceRrc()
        self.dense = Rrc()
        self.sparse = Rrc()
        self.inputs = dict(INPUTS)
        self.now = 0
        self.played: list[Step] = []

    def play(self, step: Step) -> dict[str, tuple[object, ...]]:
        """Play one tick; return what each of the three shows after it."""
        self.played.append(step)
        self.now += 1
        now_us = self.now * TICK_US
        for name, value in step.changes:
            self.inputs[name] = value
            self.dense.inputs.set(name, value)
            self.sparse.inputs.set(name, value)
        model = self.model
        sent = model.tick(self.now, step.rx, self.inputs)
        load = sum(model.costs) // 10
        shown = (
            *(model.state, model.gear, model.buzzer, model.out_v, model.out_w, model.speed_mode),
            *(load, 100 - load, model.backlog, model.pace()),
        )
        dense_sent = self.dense.tick(now_us, step.rx)
        wanted = step.rx != b"" or now_us >= self.sparse.due_us
        sparse_sent = self.sparse.tick(now_us, step.rx) if wanted else b""
        return {
            "model": (sent, *shown),
            "device": (dense_sent, *map(self.dense.read, SHOWN)),
            "device, when due": (sparse_sent, *map(self.sparse.read, SHOWN)),
        }


def differ(views: dict[str, tuple[object, ...]]) -> bool:
    return len(set(views.values())) > 1


def first_difference(steps: Iterable[Step]) -> int:
    """Return the number of steps up to the first difference, 0 if there is none."""
    pair = Pair()
    for number, step in enumerate(steps, 1):
        if differ(pair.play(step)):
            return number
    return 0


def minimal(steps: list[Step]) -> list[Step]:
    """Leave out of a session what its first difference does not need."""
    steps = steps[: first_difference(steps)]
    while (shorter := simpler_steps(fewer_steps(steps))) != steps:
        steps = shorter
    return steps


def fewer_steps(steps: list[Step]) -> list[Step]:
    size = len(steps) // 2
    while size:
        at = 0
        while at < len(steps):
            shorter = steps[:at] + steps[at + size :]
            length = first_difference(shorter)
            if length:
                steps = shorter[:length]
            else:
                at += size
        size //= 2
    return steps


def simpler_steps(steps: list[Step]) -> list[Step]:
    for i, step in enumerate(steps):
        bits = [line for line in step.rx.splitlines(keepends=True) if len(line) < len(step.rx)]
        candidates = [Step(b""), Step(b"", step.changes), Step(step.rx)]
        candidates += [Step(line, step.changes) for line in bits]
        candidates += [Step(step.rx, (change,)) for change in step.changes]
        for simpler in candidates:
            shorter = [*steps[:i], simpler, *steps[i + 1 :]]
            if simpler != step and first_difference(shorter) == len(steps):
                steps = shorter
                break
    return steps


def transcript(steps: list[Step]) -> str:
    """Return a session as text, its quiet ticks left out."""
    pair = Pair()
    rows = []
    for number, step in enumerate(steps, 1):
        before = pair.model.state
        views = pair.play(step)
        sent = views["model"][0]
        if step.rx or step.changes or sent or differ(views) or pair.model.state != before:
            changes = " ".join(f"{name}={value}" for name, value in step.changes)
            rows.append(f"tick {number}: {changes} rx {step.rx!r}")
            seen = views if differ(views) else {"all": views["model"]}
            rows += [f"    {who}: {view}" for who, view in seen.items()]
    return "\n".join(rows)


def hex_digits(value: int, width: int, upper: bool) -> str:
    return f"{value:0{width}{'X' if upper else 'x'}}"


class Chance:
    """Random acts from a seed."""

    def __init__(self, seed: int) -> None:
        self.random = random.Random(seed)
        kinds = [self.commands, self.commands, self.stick, self.buttons, self.other]
        self.kinds = [kind for kind in kinds for _ in range(self.random.choice((2, 5, 10, 30)))]
        self.kinds += [self.load] * self.random.choice((0, 0, 1, 5))
        self.kinds += [self.power, self.faults] * self.random.choice((0, 1, 1, 4))
        # Most sessions shall not be stopped by the host all the time.
        rare = {"poweroff", "watchdog", "stablemode"} if self.random.randrange(3) else set()
        self.names = [name for name in NAMES if name not in rare]
        self.names += ["limit", "output", "joystick", "status"] * self.random.choice((1, 3))
        self.names += ["limit", "joystick"] * self.random.choice((0, 10))
        self.names += sorted(rare)[: self.random.randint(0, 3)]

    def one_in(self, count: int) -> bool:
        return self.random.randrange(count) == 0

    def percent(self) -> int:
        if self.one_in(2):
            return self.random.choice(PERCENTS)
        return self.random.randint(-100, 100)

    def up_to(self, top: int) -> int:
        """Return a number in 0..top, rarely beyond, often at the ends."""
        if self.one_in(60):
            return min(255, top + self.random.choice((1, 1, 30)))
        if self.one_in(3):
            return self.random.choice([value for value in BYTES if value <= top])
        return self.random.randint(0, top)

    def hex2(self, *tops: int) -> str:
        return "".join(hex_digits(self.up_to(top), 2, self.one_in(3)) for top in tops)

    def hex1(self, top: int) -> str:
        value = self.random.randint(0, 15) if self.one_in(30) else self.random.randint(0, top)
        return hex_digits(value, 1, self.one_in(3))

    def signed(self) -> str:
        value = self.random.randint(-128, 127) if self.one_in(30) else self.percent()
        return hex_digits(value % 256, 2, self.one_in(3))

    def parameters(self, name: str) -> str:
        text = ""
        match name:
            case "limit":
                loose = "".join(hex_digits(self.random.choice((100, 255)), 2, False) for _ in "345")
                rest = loose if self.one_in(3) else self.hex2(*[200] * 3)
                text = self.hex2(100, 100) + rest
            case "output":
                text = self.signed() + self.signed()
            case "speedmode":
                text = self.hex1(5) + self.hex1(1)
            case "joystick":
                text = self.joystick()
            case "watchdog":
                text = hex_digits(self.random.choice((0, 0, 1, 2, 3, 5, 20, 100, 255)), 2, False)
            case "stablemode":
                text = self.hex1(1)
            case "status":
                text = ("B" if self.one_in(30) else "A") + self.hex1(1)
            case "beep":
                text = self.hex2(*[self.random.choice((0, 1, 3, 20, 255)) for _ in range(10)])
        return text

    def joystick(self) -> str:
        if self.one_in(2):
            low = [0, 0]
            high = [100, 100]
        else:
            low = [self.up_to(60) for _ in "vw"]
            high = [self.up_to(100) for _ in "vw"]
            if not self.one_in(10):
                high = [max(low[i] + 1, high[i]) for i in range(2)]
            if self.one_in(10):
                high[self.random.randrange(2)] = low[self.random.randrange(2)]
        zones = "".join(hex_digits(value, 2, False) for value in low + high)
        exponents = self.hex1(15) + self.hex1(15)
        mode = self.random.choice("0122333")
        rest = self.hex2(self.random.choice((0, 5, 20, 100)), 90, 90)
        return zones + exponents + mode + (rest if self.one_in(2) else "051e2d")

    def line(self) -> Line:
        name = self.random.choice(self.names)
        line = Line((name + self.parameters(name)).encode())
        return self.mutated(line) if self.one_in(7) else line

    def mutated(self, line: Line) -> Line:
        text = line.text
        at = self.random.randrange(len(text) + 1)
        head, here, tail = text[:at], text[at : at + 1], text[at + 1 :]
        blank = self.random.choice((b" ", b"\r", b"\0", b"_"))
        extra = self.random.choice((b"0", b"f", b"00", b"g"))
        digit = bytes([self.random.choice(b"0123456789abcdefABCDEFgG ")])
        return self.random.choice(
            (
                Line(text, checked=False),
                Line(text + digit, checked=False),
                Line(head + here.swapcase() + tail),
                Line(head + blank + here + tail),
                Line(head + self.noise(2) + tail),
                Line(text + extra),
                Line(text[:-1]),
                Line(text, end=self.random.choice((b"\r\n", b"\r\r\n", b"\n\n", b"\r"))),
                Line(self.noise(20)),
                Line(b"", checked=self.one_in(3), end=self.random.choice((b"\n", b"\r\n"))),
            )
        )

    def noise(self, most: int) -> bytes:
        count = self.random.randint(0, most)
        return self.random.randbytes(count) if self.one_in(2) else b"x" * count

    def commands(self) -> Act:
        count = self.random.choice((1, 1, 1, 1, 2, 2, 3, 4))
        lines = tuple(self.line() for _ in range(count))
        if self.one_in(12):
            return Act(lines, chunk=self.random.randint(1, 20))
        if self.one_in(12):
            return Act(lines, repeat=True, ticks=self.random.randint(2, 40))
        return Act(lines, ticks=self.random.choice((1, 1, 1, 2, 2, 3, 10)))

    def stick(self) -> Act:
        changes = {"stick_v_pct": self.percent(), "stick_w_pct": self.percent()}
        if self.one_in(4):
            changes["stick_w_pct"] = changes["stick_v_pct"] * self.random.choice((-1, 1))
        if self.one_in(3):
            small = self.random.randint(0, 5)
            changes = {"stick_v_pct": -small, "stick_w_pct": small - 5}
            return Act((), changes, self.random.choice((1, 5, 18, 19, 20, 21)))
        if self.one_in(4):
            back = self.random.randint(20, 100)
            side = self.random.randint(-back // 2, back // 2)
            changes = {"stick_v_pct": -back, "stick_w_pct": side}
        if self.one_in(3):
            del changes[self.random.choice(("stick_v_pct", "stick_w_pct"))]
        return Act((), changes, self.random.choice((1, 1, 1, 2, 3, 60, 120)))

    def buttons(self) -> Act:
        changes = {}
        for _ in range(self.random.choice((1, 1, 2, 3))):
            changes[self.random.choice(BUTTONS[1:])] = self.random.randint(0, 1)
        if self.one_in(3):
            changes["alarm_button"] = 1
        return Act((), changes, self.random.choice((1, 1, 1, 2, 5)))

    def power(self) -> Act:
        level = self.random.randint(0, 1)
        if self.one_in(8):
            return Act((), {"rrc_power": 0, "power_button": level}, self.random.randint(1, 3))
        return Act((), {"power_button": level}, self.random.choice((1, 1, 2, 9, 10, 30, 50)))

    def faults(self) -> Act:
        count = self.random.choice((1, 1, 2))
        changes = {self.random.choice(FAULTS): 1 for _ in range(count)}
        if self.one_in(40):
            return Act((), {"bus_unplugged": 1}, self.random.choice((30, 200, 301)))
        return Act((), changes, self.random.choice((1, 5, 8, 9, 10, 11, 15)))

    def load(self) -> Act:
        changes = {"extra_load_pct": self.random.choice((0, 10, 40, 70, 71, 100, 300))}
        return Act((), changes, self.random.choice((1, 2, 3, 5)))

    def other(self) -> Act:
        match self.random.randrange(6):
            case 0:
                return Act((), {"gauge": self.random.randint(1, 10)})
            case 1:
                lines = (Line(self.noise(300), end=b""), *([self.line()] if self.one_in(2) else []))
                return Act(lines, chunk=self.random.choice((0, 0, 115, 115, 40)))
            case 2:
                mode = self.random.randint(1, 6)
                lines = (Line(f"watchdog{mode:02x}".encode()),)
                return Act(lines, {}, self.random.randint(mode - 1, mode + 1) or 1)
            case _:
                return Act((), {}, self.random.choice((1, 2, 5, 20, 60)))

    def act(self) -> Act:
        """Return one act of some kind."""
        act = self.random.choice(self.kinds)()
        if self.one_in(10):
            changes = self.random.choice(self.kinds)().changes
            act = Act(act.lines, act.changes | changes, act.ticks, act.repeat, act.chunk)
        return act

    def recovery(self, pair: Pair) -> Act | None:
        """Bring a device that has stopped or was left in trouble back into operation."""
        inputs = pair.inputs
        stuck = {name: INPUTS[name] for name in (*FAULTS, "rrc_power", "extra_load_pct")}
        if any(inputs[name] != value for name, value in stuck.items()) and not self.one_in(3):
            return Act((), stuck)
        stopped = pair.model.state in ("Off", "Initialize", "WaitPowerOn", "PowerOffByOthers")
        if not stopped and not pair.model.status and self.one_in(6):
            wish = self.random.choice((b"statusA1", b"statusA1", b"stablemode1"))
            return Act((Line(wish),))
        if not stopped or self.one_in(4):
            return None
        if inputs["power_button"]:
            return Act((), {"power_button": 0})
        return Act((), {"power_button": 1}, self.random.choice((1, 10, 31)))


def play_random(seed: int, ticks: int) -> Pair:
    """Play a random session; fail with a minimal transcript at its first difference."""
    chance = Chance(seed)
    pair = Pair()
    while pair.now < ticks:
        act = chance.recovery(pair) or chance.act()
        play_act(pair, act, f"seed {seed}")
    return pair


def play_act(pair: Pair, act: Act, title: str) -> None:
    for step in act.steps(pair.model.stable):
        if differ(pair.play(step)):
            raise AssertionError(f"{title}\n{transcript(minimal(pair.played))}")


CHANCES = st.integers(0, 2**32).map(Chance)
LINES = st.builds(
    Line,
    st.one_of(
        st.binary(max_size=12),
        st.tuples(
            st.sampled_from([name.encode() for name in NAMES]),
            st.text("0123456789abcdefABCDEF", max_size=25).map(str.encode),
        ).map(b"".join),
        CHANCES.map(lambda chance: chance.line().text),
    ),
    checked=st.booleans(),
    end=st.sampled_from((b"\n", b"\n", b"\r\n", b"")),
)
CHANGES = st.fixed_dictionaries(
    {},
    optional={
        **{name: st.integers(0, 1) for name in BUTTONS},
        **{name: st.sampled_from((0, 0, 0, 1)) for name in FAULTS},
        "rrc_power": st.sampled_from((1, 1, 1, 1, 1, 1, 1, 0)),
        "stick_v_pct": st.sampled_from(PERCENTS),
        "stick_w_pct": st.sampled_from(PERCENTS),
        "gauge": st.integers(1, 10),
        "extra_load_pct": st.sampled_from((0, 0, 0, 70, 200)),
    },
)
ACTS = st.one_of(
    st.builds(
        Act,
        st.lists(LINES, max_size=4).map(tuple),
        CHANGES,
        ticks=st.integers(1, 15),
        repeat=st.booleans(),
        chunk=st.sampled_from((0, 0, 0, 1, 7)),
    ),
    CHANCES.map(Chance.act),
)
POWER_ON = (Act(ticks=2), Act((), {"power_button": 1}), Act((), {"power_button": 0}, 30))


@settings(
    max_examples=examples(80),
    deadline=None,
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow],
)
@given(st.booleans(), st.lists(ACTS, min_size=3, max_size=30))
def test_any_session_is_played_as_the_model_plays_it(powered: bool, acts: list[Act]) -> None:
    pair = Pair()
    for act in [*(POWER_ON if powered else ()), *acts]:
        play_act(pair, act, "hypothesis")


@pytest.mark.parametrize("seed", range(8))
def test_random_sessions_are_played_as_the_model_plays_them(seed: int) -> None:
    for session in range(25):
        play_random(1000 * seed + session, 300)


SCRIPTS = {
    "power-on times out": (
        *(Act(ticks=2), Act((), {"bus_unplugged": 1, "power_button": 1}), Act(ticks=310)),
        *(Act((), {"power_button": 0}), Act((), {"power_button": 1}, 310)),
    ),
    "plugged in the last tick": (
        *(Act(ticks=2), Act((), {"bus_unplugged": 1, "power_button": 1}, 300)),
        *(Act((), {"bus_unplugged": 0}), Act(ticks=3)),
    ),
    "a fault of the last drive does not count in the next": (
        *(*POWER_ON, Act((), {"bus_noise": 1}, 9)),
        *(Act((), {"power_button": 1}), Act((), {"bus_noise": 0, "power_button": 0}, 55)),
        *(Act((), {"power_button": 1}, 31), Act((), {"bus_noise": 1}, 12)),
    ),
    "a power cut empties the receive buffer": (
        *(*POWER_ON, Act((Line(b"x" * 300, end=b""),)), Act((), {"rrc_power": 0})),
        *(Act((), {"rrc_power": 1}, 2), Act((Line(b"device"),), ticks=3)),
        *(Act((Line(b"dev", end=b""),)), Act((), {"rrc_power": 0})),
        *(Act((), {"rrc_power": 1}, 2), Act((Line(b"ice"),), ticks=3)),
    ),
    "noise of one tick does not add up": (
        *(*POWER_ON, *[Act((), {"vr2_fault": min(i % 9, 1)}) for i in range(40)]),
        Act((), {"vr2_fault": 1}, 12),
    ),
}


@pytest.mark.parametrize("acts", SCRIPTS.values(), ids=SCRIPTS)
def test_a_written_session_is_played_as_the_model_plays_it(acts: tuple[Act, ...]) -> None:
    pair = Pair()
    for act in acts:
        play_act(pair, act, "script")


def any_stick(chance: random.Random) -> dict[str, int]:
    v, w = chance.sample(PERCENTS, 2)
    v = chance.choice((0, v, v, v))
    turn = chance.choice((v, -v, w, max(v - 1, -100), min(v + 1, 100)))
    return {"stick_v_pct": v, "stick_w_pct": turn}


def gear_acts_by_command(chance: random.Random, mode: int) -> Iterator[Act]:
    zones = chance.choice(("00006464", "0a0a5a5a"))
    angles = "".join(f"{chance.choice((0, 30, 45, 60, 89, 90, 90)):02x}" for _ in "ab")
    joystick = Line(f"joystick{zones}00{mode}05{angles}".encode())
    yield Act((Line(b"output0000"), joystick), {"stick_v_pct": -100, "stick_w_pct": 0})
    yield Act((Line(b"limit6464ffffff"),), chance.choice(({}, any_stick(chance))))
    yield Act((), any_stick(chance))


def gear_acts_by_buttons(chance: random.Random) -> Iterator[Act]:
    yield Act((), {"alarm_button": 0, "speed_up_button": 1, "speed_down_button": 0})
    yield Act((), {"alarm_button": 1, "stick_v_pct": -100, "stick_w_pct": 0})
    yield Act((), any_stick(chance))
    yield Act((), {"alarm_button": 0, "speed_down_button": 1})
    yield Act((), {"alarm_button": 1} | any_stick(chance))
    yield Act((), any_stick(chance))


@pytest.mark.parametrize("mode", [2, 3, None])
def test_gears_change_and_fade_as_in_the_model(mode: int | None) -> None:
    chance = random.Random(7)
    pair = Pair()
    for act in POWER_ON:
        play_act(pair, act, "gears")
    for _ in range(2000):
        acts = gear_acts_by_command(chance, mode) if mode else gear_acts_by_buttons(chance)
        for act in acts:
            play_act(pair, act, "gears")


def test_limits_are_those_of_the_model() -> None:
    chance = random.Random(8)
    pair = Pair()
    for act in POWER_ON:
        play_act(pair, act, "limits")
    for _ in range(5000):
        stick = {"stick_v_pct": chance.randint(-100, 100), "stick_w_pct": chance.randint(-100, 100)}
        tops = (100, 100, 255, chance.choice((10, 100, 255)), 255)
        limits = bytes(chance.choice((top, chance.randint(0, top))) for top in tops)
        play_act(pair, Act((Line(b"limit" + limits.hex().encode()),), stick), "limits")


def test_a_button_held_through_power_on_is_pressed_in_the_first_tick_of_standby() -> None:
    pair = Pair()
    play_act(pair, Act(ticks=2), "")
    play_act(pair, Act((), {"power_button": 1, "alarm_button": 1, "stick_v_pct": 50}, 31), "")
    assert pair.dense.read("state") == "Standby"
    assert pair.dense.read("out_v_pct") == 0
    play_act(pair, Act(), "")
    assert pair.dense.read("out_v_pct") == 50


def test_a_button_held_through_power_on_is_due() -> None:
    device = Rrc()
    device.tick(TICK_US, b"")
    for name in ("power_button", "alarm_button"):
        device.inputs.set(name, 1)
    for tick in range(2, 33):
        device.tick(tick * TICK_US, b"")
    assert device.read("state") == "Standby"
    assert device.due_us <= 33 * TICK_US


def test_a_button_held_while_rrc_power_comes_back_is_a_press() -> None:
    device = Rrc()
    device.inputs.set("power_button", 1)
    sent = device.tick(TICK_US, b"") + device.tick(2 * TICK_US, b"")
    assert sent == b"EV:Initialized\nEV:PowerOnTrigger\n"


def main(ticks: int, seed: int) -> int:
    """Play this many random ticks in sessions of 2000; return the exit code."""
    played = 0
    while played < ticks:
        try:
            played += play_random(seed, min(2000, ticks - played)).now
        except AssertionError as difference:
            print(f"difference after {played} equal ticks, {difference}")
            return 1
        seed += 1
    print(f"{played} ticks equal")
    return 0


if __name__ == "__main__":
    count, first_seed, *_ = [int(text) for text in sys.argv[1:]] + [100_000, 0][len(sys.argv) - 1 :]
    sys.exit(main(count, first_seed))
