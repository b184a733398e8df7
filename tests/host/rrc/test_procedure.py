"""The test procedure of the manual, with an operator who does what is asked, or does not."""

from __future__ import annotations

import pytest

from tests.host.rrc.chair_bench import Bench
from tickrig.host.rrc.chair import Guard
from tickrig.host.rrc.procedure import STEPS, Procedure, Quit, StepResult

STICK = {
    "Push the stick forward": (100, 0),
    "Pull the stick straight back": (-100, 0),
    "Push it to the right": (-60, 60),
    "Let the stick go": (0, 0),
}
SAMPLES = {
    "limit3232ffffff": "D",
    "output1e00": "7",
    "speedmode40": "A",
    "joystick00006464003051e2d": "8",
    "statusA1": "6",
    "beep646464640a0a0a0a0a0a": "A",
    "watchdog64": "B",
    "poweroff": "8",
}
"""Each with its CHECK, as in the manual."""


class Willing:
    """An operator of an emulated chair, who sees its outputs."""

    def __init__(self, bench: Bench, *, answer: bool = True) -> None:
        self.bench, self._answer = bench, answer
        self.told: list[str] = []
        self.pressed: list[str] = []

    def instruct(self, text: str) -> None:
        self.told.append(text)
        inputs = self.bench.rrc.inputs
        for begins, (v_pct, w_pct) in STICK.items():
            if text.startswith(begins):
                if v_pct and w_pct:  # on the way it is to the right
                    inputs.set("stick_w_pct", w_pct)
                    self.bench.chair.client.run_for(50_000)
                inputs.set("stick_v_pct", v_pct)
                inputs.set("stick_w_pct", w_pct)
        for name in ("power", "speed-up"):
            if f"Press the {name} button" in text:
                self.pressed.append(f"{name.replace('-', '_')}_button")

    def confirms(self, question: str) -> bool:
        self.told.append(question)
        return self._answer

    def waits(self) -> None:
        """Press a button for a moment."""
        if self.pressed:
            name = self.pressed.pop()
            for value in (1, 0):
                self.bench.rrc.inputs.set(name, value)
                self.bench.chair.client.run_for(50_000)


def bench() -> Bench:
    return Bench(Guard(stable=False), on=False)


def run(operator: Willing) -> Procedure:
    found: list[StepResult] = []
    procedure = Procedure(operator.bench.chair, operator, found.append)
    with operator.bench.chair:
        procedure.run()
    assert found == procedure.results
    return procedure


def test_an_rrc_passes_both_rounds() -> None:
    procedure = run(Willing(bench()))
    assert [each for each in procedure.results if not each.passed] == []
    assert procedure.passed
    assert len(procedure.results) == STEPS
    samples = [(each.sent, each.check) for each in procedure.results if each.sent]
    assert samples == [
        *((sample, "") for sample in SAMPLES),
        ("stablemode1", "1"),
        *SAMPLES.items(),
    ]


def test_what_the_operator_does_not_see_fails_the_step() -> None:
    class Blind(Willing):
        def confirms(self, question: str) -> bool:
            return "wheels off the ground" in question

    procedure = run(Blind(bench()))
    failed = [each.step for each in procedure.results if not each.passed]
    assert failed == ["forward at 30 %", "two long tones, three short ones"] * 2
    assert procedure.results[2].reason == "the operator says no: Did both wheels turn forward?"


def test_wheels_on_the_ground_begin_nothing() -> None:
    with pytest.raises(Quit, match="lift the wheels first"):
        run(Willing(bench(), answer=False))


def test_a_chair_that_stays_off_ends_the_procedure() -> None:
    class Idle(Willing):
        def waits(self) -> None:
            """Press nothing."""

    off = Idle(bench())
    found: list[StepResult] = []
    with (
        off.bench.chair,
        pytest.raises(Quit, match="VR2 is off, and all other steps need it: press its power"),
    ):
        Procedure(off.bench.chair, off, found.append).run()
    assert [(each.step, each.passed) for each in found] == [("VR2 starts", False)]


def test_a_chair_that_does_something_else_fails_the_step() -> None:
    on = bench()
    on.link.spoil = lambda line: line.replace(b"limit3232", b"limit6464")
    procedure = run(Willing(on))
    assert procedure.results[1].reason == "stick at 100 %, output at 100 %, not 1..50 %"


def test_a_stick_that_nobody_moves_is_waited_for_a_minute() -> None:
    class Idle(Willing):
        def instruct(self, text: str) -> None:
            if "forward, as far" not in text:
                super().instruct(text)

    procedure = run(Idle(bench()))
    assert procedure.results[1].reason == "waited 60 s for the stick forward"
