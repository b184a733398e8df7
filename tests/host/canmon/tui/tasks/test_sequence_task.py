from __future__ import annotations

from pathlib import Path

import pytest

from tests.host.canmon.tui.rig_session import RigSession
from tickrig.host.canmon.tui.panels.sequence_panel import SequenceTask
from tickrig.host.text.steps import StepError

START = Path(__file__).parents[5] / "examples/sequences/start_drive.toml"


class Runner:
    """The task on a session with our drive."""

    def __init__(self, *, armed: bool = True) -> None:
        self.session = RigSession()
        self.task = SequenceTask(self.session.model.eds)
        self.session.tasks.append(self.task)
        if armed:
            self.session.arm()

    def start(self, text: str) -> None:
        self.task.start(self.task.parse(text, "editor"))

    def events(self, span_us: int) -> list[str]:
        self.session.run(span_us)
        return [f"{event.at_us} {event.mark} {event.text}" for event in self.task.events]


def test_the_example_turns_our_drive() -> None:
    runner = Runner()
    runner.start(START.read_text())
    events = runner.events(10_000_000)
    assert (events[-1].split(" ", 1)[1], runner.task.running) == (". 5 met, 0 missed", False)
    assert runner.session.drive.read("shaft_deg") != 0


def test_plain_lines_send_at_their_times_from_the_beginning() -> None:
    runner = Runner()
    runner.session.run(5_000)
    runner.start("# sync\nloop 2\n+0 080#\n+10 081#\n")
    assert runner.events(100_000) == [
        "0 > 080#",
        "10000 > 081#",
        "10000 > 080#",
        "20000 > 081#",
        "20000 . 0 met, 0 missed",
    ]


def test_what_the_sequence_sends_meets_nothing() -> None:
    runner = Runner()
    runner.start('[[step]]\nsend = "123#01"\n[[step]]\nexpect = "123#*"\nwithin = "1s"\n')
    assert runner.events(2_000_000)[1] == "1000000 ? editor:4: no 123#* within 1000 ms"


def test_stopping_gives_it_up() -> None:
    runner = Runner()
    runner.start("loop forever\n+10 080#")
    runner.events(50_000)
    runner.session.disarm()
    assert runner.events(1_000_000)[-1] == "40000 . stopped"
    assert not runner.task.running


def test_another_one_takes_the_place_of_one_that_runs() -> None:
    runner = Runner()
    runner.start("loop forever\n+10 080#")
    runner.events(50_000)
    runner.start("+0 081#")
    assert runner.events(50_000) == ["0 > 081#", "0 . 0 met, 0 missed"]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", r"editor:1: no \[\[step\]\]"),
        ("+x 080#", "editor:1: '\\+x 080#' is not"),
        ('[[step]]\nsend = "9.rpdo1"', "editor:2: 9.rpdo1: no description of node 9"),
        ('[[step]]\nexpect = "node="', "editor:2: "),
    ],
)
def test_a_mistake_is_told_with_its_line(text: str, reason: str) -> None:
    with pytest.raises(StepError, match=reason):
        Runner().start(text)
