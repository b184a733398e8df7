from __future__ import annotations

import pytest

from tests.host.canmon.tui.rig_session import RigSession
from tickrig.host.canmon.model.transmit import parse_row_text
from tickrig.host.canmon.tui.panels.transmit_panel import TransmitTask


class Sender:
    """The task on a session with our drive."""

    def __init__(self, *rows: str) -> None:
        self.session = RigSession()
        self.task = TransmitTask(self.session.model.eds)
        self.session.tasks.append(self.task)
        for row in rows:
            self.task.add(parse_row_text(row))

    def enable(self, number: int) -> None:
        self.task.enable(number, self.session.now_us, armed=self.session.armed)

    def once(self, number: int) -> None:
        self.task.once(number, armed=self.session.armed)

    def sent(self, span_us: int) -> list[str]:
        self.session.run(span_us)
        sent, self.session.frames = self.session.frames, []
        return sent


def test_an_enabled_row_is_sent_in_each_period_and_others_by_hand() -> None:
    sender = Sender("000#0105", "080# --every 10ms")
    sender.session.arm()
    sender.enable(1)
    assert sender.sent(99_000) == ["080#"] * 10
    sender.once(0)
    assert sender.sent(500) == ["000#0105"]
    assert sender.session.model.board.rows()[0].commanded is not None


def test_nothing_is_sent_while_it_is_not_armed() -> None:
    sender = Sender("080# --every 10ms")
    with pytest.raises(ValueError, match="not armed"):
        sender.enable(0)
    with pytest.raises(ValueError, match="not armed"):
        sender.once(0)
    assert (sender.sent(100_000), sender.session.withheld) == ([], 0)


def test_arming_again_sends_nothing_by_itself() -> None:
    sender = Sender("080# --every 10ms")
    sender.session.arm()
    sender.enable(0)
    sender.once(0)
    sender.session.disarm()
    sender.session.arm()
    assert sender.sent(100_000) == []


def test_a_row_that_is_enabled_twice_sends_no_more() -> None:
    sender = Sender("080# --every 10ms")
    sender.session.arm()
    sender.enable(0)
    sender.enable(0)
    assert sender.sent(100_000) == []


def test_a_row_is_changed_and_taken_out() -> None:
    sender = Sender("080# --every 10ms", "100#00")
    sender.session.arm()
    sender.enable(0)
    sender.task.change(0, parse_row_text("081#"))
    assert sender.sent(100_000) == []
    sender.task.remove(1)
    sender.once(0)
    assert (sender.sent(1_000), len(sender.task.words)) == (["081#"], 1)


def test_a_change_that_is_refused_leaves_the_row() -> None:
    sender = Sender("080#")
    with pytest.raises(ValueError, match="not a frame"):
        sender.task.change(0, parse_row_text("xyz#"))
    assert [str(words) for words in sender.task.words] == ["080#"]
