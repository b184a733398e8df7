from __future__ import annotations

from collections.abc import Callable

import pytest

from tests.emulators.lamp import Lamp
from tickrig.emulators.bench.operator import FaultSpec
from tickrig.emulators.bench.running_emulator import Transcript
from tickrig.emulators.scenario import Press, ScenarioEnd, ScenarioParser, ScenarioPlayer, Send, Set
from tickrig.emulators.serial.emulator import Emulator
from tickrig.host.text.steps import StepError


def shout(text: bytes) -> bytes:
    return text.upper() + b"!\n"


def parse(text: str, emulator: Emulator) -> tuple[tuple[int | None, object], ...]:
    parser = ScenarioParser(emulator.device, emulator.operator, {"shout": shout})
    return tuple(
        (step.at_us, step.what or (step.wanted[0].text, step.within_us))
        for step in parser.parse(text, "s.txt")
    )


def play(text: str, *, steps: int = 0, stays: bool = False) -> tuple[list[str], ScenarioPlayer]:
    out: list[str] = []
    emulator = Emulator("lamp", Lamp())
    parser = ScenarioParser(emulator.device, emulator.operator, {"shout": shout})
    scenario = parser.parse(text, "s.txt")
    player = ScenarioPlayer(emulator, scenario, Transcript(emulator, out.append), stays=stays)
    while emulator.running and (not steps or len(out) < steps):
        emulator.step()
    return out, player


def test_a_scenario_is_read_into_values() -> None:
    text = """
        # nothing but a comment

        0.1   send a\\x41 b  # a comment
        +5ms  set place 1 -2
        200ms press key for 1s
        0.2   fault flip=0.5@1s-2s
        1     expect a # within 5ms
        2s    expect a * within 5ms#x
    """.replace("expect a # within", "expect a within")
    with pytest.raises(StepError, match=r"s\.txt:9: '5ms#x' is not a time"):
        parse(text, Emulator("lamp", Lamp()))
    assert parse(text.replace("#x", ""), Emulator("lamp", Lamp())) == (
        (100_000, Send(b"aA b\n", b"aA b")),
        (105_000, Set("place", (1, -2))),
        (200_000, Press("key", 1_000_000)),
        (200_000, FaultSpec("flip", ("0.5",), 1_000_000, 2_000_000)),
        (1_000_000, ("a", 5_000)),
        (2_000_000, ("a *", 5_000)),
    )
    assert parse("1 send\n2 end", Emulator("lamp", Lamp()))[0] == (1_000_000, Send(b"\n", b""))
    assert parse("2 end", Emulator("lamp", Lamp())) == ((2_000_000, ScenarioEnd()),)


@pytest.mark.parametrize(
    ("line", "error"),
    [
        ("1", "'1' is not 'TIME ACTION ...', as '1.5s press NAME'"),
        ("1x send a", "'1x' is not a time: write 1.5s, 200ms or 250us"),
        ("-1 send a", "'-1' is not a time"),
        ("0.5 send a", "0.5 is earlier than the action above"),
        ("1 pres key", "no action 'pres'; did you mean 'press'?"),
        ("1 send \\q", "is not ASCII"),
        ("1 send é", "is not ASCII"),
        ("1 raw 6", "raw takes bytes in hex, as '6f 6b 0a', got '6'"),
        ("1 raw", "got ''"),
        ("1 set", "no input ''; known: place, lamp"),
        ("1 set lamp", "lamp takes one value (lamp), got 0"),
        ("1 set lamp on", "lamp takes a whole number, not 'on'"),
        ("1 set place 1 99", "y_mm 99 is not in -10..10 mm"),
        ("1 press", "press takes NAME or NAME for DURATION, got ''"),
        ("1 press key 5", "got 'key 5'"),
        ("1 press key for 0", "a press lasts at least 1 us"),
        ("1 press lamp", "no button 'lamp'; known: key"),
        ("1 release lamp", "no button 'lamp'; known: key"),
        ("1 fault", "'' is not a fault: write NAME[=ARGUMENT[,ARGUMENT]]"),
        ("1 fault flip=0", "flip takes a rate above 0 and up to 1, as flip=0.01; got 0"),
        ("1 fault flip=", "'' is not a rate"),
        ("1 fault flip=x", "'x' is not a rate"),
        ("1 fault dead@0-1", "dead@0-1 would have ended before 1"),
        ("1 clear key", "no fault 'key'; known: flip, drop, dup, cut, delay"),
        ("1 watch", "no output ''; known: state, count"),
        ("1 watch state x", "no output 'x'; known: state, count"),
        ("1 expect a", "expect takes TEXT within DURATION, got 'a'"),
        ("1 expect a within", "expect takes TEXT within DURATION"),
        ("1 expect a within 5x", "'5x' is not a time"),
        ("1 end now", "end takes nothing, got 'now'"),
        ("1 end\n1 send a", "send comes after end"),
    ],
)
def test_a_bad_line_says_where_and_what_is_allowed(line: str, error: str) -> None:
    with pytest.raises(StepError) as caught:
        parse("\n1 send a\n" + line, Emulator("lamp", Lamp()))
    number = 4 if "\n" in line else 3
    assert str(caught.value).startswith(f"s.txt:{number}: ")
    assert error in str(caught.value)


def test_a_fault_may_be_timed_from_its_line_on() -> None:
    steps = parse("1 fault dead@+500ms-+2s\n+1 fault cut@+1", Emulator("lamp", Lamp()))
    assert [what for _, what in steps] == [
        FaultSpec("dead", (), 1_500_000, 3_000_000),
        FaultSpec("cut", (), 3_000_000),
    ]


def test_reading_a_scenario_touches_nothing() -> None:
    emulator = Emulator("lamp", Lamp())
    parse("0 set place 1 2\n0 press key\n0 fault dead\n0 fault cut", emulator)
    assert emulator.device.inputs["x_mm"] == 0
    assert emulator.operator.active_faults == ()


def test_a_transcript_shows_all_that_happens() -> None:
    out, player = play(
        """
        0     watch count
        5ms   send ab
        +5ms  shout cd
        +5ms  raw ff 0a
        20ms  press key for 2ms
        30ms  set lamp 0
        40ms  fault drop=1
        45ms  fault dead@50ms-60ms
        +5ms  clear drop
        70ms  expect xy within 5ms
        80ms  end
        """
    )
    assert out == [
        "0.000000 * state Lit",
        "0.000000 * count 0",
        "0.001261 < hi",
        "0.005000 > ab",
        "0.006000 * count 3",
        "0.006261 < ab",
        "0.010000 > CD!",
        "0.011000 * count 7",
        "0.011348 < CD!",
        r"0.015000 > \xff\n",
        "0.016000 * count 9",
        r"0.016174 < \xff",
        "0.020000 ! key=1",
        "0.020521 < click",
        "0.022000 ! key=0",
        "0.030000 ! lamp=0",
        "0.030000 * state Dark",
        "0.040000 ! drop=1",
        "0.050000 ! drop=0",
        "0.050000 ! dead=1",
        "0.060000 ! dead=0",
        "0.075000 ? s.txt:11: no line 'xy' within 5 ms of 0.070000",
    ]
    assert (player.met, player.missed) == (0, 1)


@pytest.mark.parametrize(
    ("text", "met"),
    [
        ("0 expect hi within 2ms", 1),
        ("0 expect h* within 2ms", 1),
        ("0 expect *i within 2ms", 1),
        ("0 expect h.* within 2ms", 0),
        ("0 expect h within 2ms", 0),
        ("0 expect hi within 1ms", 0),
        ("2ms expect hi within 1s", 0),
        ("0 expect hi within 2ms\n0 expect * within 2ms", 2),
        ("0 expect hi within 1s\n1.1ms end", 0),
    ],
)
def test_an_expectation_is_met_by_a_whole_line_in_time(text: str, met: int) -> None:
    _, player = play(text)
    assert player.met == met
    assert bool(player.missed) is (met == 0)


def test_a_line_meets_an_expectation_once() -> None:
    _, player = play("0 send a\n0 expect a within 9ms\n10ms expect a within 9ms")
    assert (player.met, player.missed) == (1, 1)


def test_without_an_end_it_ends_with_the_last_action_or_expectation() -> None:
    assert play("")[0] == ["0.000000 * state Lit"]
    out, _ = play("0 send a\n5ms expect b within 5ms")
    assert out[-1].startswith("0.010000 ? ")


def test_it_may_stay_instead() -> None:
    _, player = play("0 send a\n5ms set lamp 0", steps=6, stays=True)
    assert player.missed == 0


ENDINGS: list[tuple[str, Callable[[list[str]], bool]]] = [
    ("1ms end", lambda out: "0.001261 < hi" not in out),
    ("2ms end", lambda out: out[-1] == "0.001261 < hi"),
]


@pytest.mark.parametrize(("text", "right"), ENDINGS)
def test_end_ends_the_run(text: str, right: Callable[[list[str]], bool]) -> None:
    assert right(play(text)[0])
