from __future__ import annotations

from collections.abc import Iterator, Sequence

import can
import pytest

from tests.host.canmon.tui.pilot import PATIENCE_US, drive_session, hear, wire_session
from tests.host.canmon.wire import Wire, new_wire
from tickrig.host.canmon.tui.session import DecodedFrame, Model, Session, open_session
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import Refused, SourceFailed
from tickrig.wire.can import CanFrame, FdFrame, Frames
from tickrig.wire.instant import NEVER


class Echo:
    """Answers each frame it hears from others."""

    def __init__(self, channel: str = "") -> None:
        self.channel, self.due_us = channel, NEVER
        self.record: list[tuple[str, str, bool]] = []
        self.stopped = False

    def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
        self.record += [(one.channel, str(one.frame), one.sent) for one, _ in records]
        return tuple(CanFrame.parse("700#") for one, _ in records if not one.sent)

    def stop(self) -> None:
        self.stopped = True


def check_for_ever(session: Session) -> None:
    while True:
        session.check()


@pytest.fixture
def session(wire: Wire) -> Iterator[Session]:
    session = wire_session(wire)
    yield session
    session.close()
    session.source.close()


def test_what_is_sent_is_heard_as_sent(wire: Wire, session: Session) -> None:
    task = Echo()
    session.tasks.append(task)
    session.arm()
    hear(session, wire, "181#01")
    assert wire.next() == "700#"
    session.step()
    assert task.record == [(wire.name, "181#01", False), (wire.name, "700#", True)]
    assert (session.sent, session.model.frames) == (1, 2)


def test_nothing_is_sent_before_it_is_armed(wire: Wire, session: Session) -> None:
    session.tasks.append(Echo())
    hear(session, wire, "181#01", "181#02")
    assert (session.withheld, session.sent, wire.all()) == (2, 0, [])


def test_to_disarm_stops_every_task(wire: Wire, session: Session) -> None:
    session.tasks += [Echo(), Echo()]
    session.arm()
    session.disarm()
    hear(session, wire, "181#01")
    assert [task.stopped for task in session.tasks if isinstance(task, Echo)] == [True, True]
    assert wire.all() == []


def test_a_task_that_is_due_is_called_without_a_frame(session: Session) -> None:
    class Alarm(Echo):
        calls = 0

        def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
            assert now_us >= self.due_us
            self.calls, self.due_us = self.calls + 1, NEVER
            return ()

    task = Alarm()
    session.tasks.append(task)
    session.step()
    assert task.calls == 0
    task.due_us = session.now_us + 1_000
    session.step(PATIENCE_US)
    assert task.calls == 1


def test_a_bus_that_takes_nothing_disarms(wire: Wire) -> None:
    def refuse(frame: CanFrame | FdFrame) -> None:
        raise SourceFailed("cannot send on can0: no buffer space")

    real = wire_session(wire)
    session = Session(real.source, Model(), {"can0": refuse})
    session.tasks.append(Echo())
    session.arm()
    hear(session, wire, "181#01")
    assert not session.armed
    assert session.trouble == "cannot send on can0: no buffer space"
    session.arm()
    assert session.trouble == ""
    session.source.close()


def test_who_leaves_does_not_wait_for_what_is_due(wire: Wire) -> None:
    sent: list[CanFrame | FdFrame] = []

    def send(frame: CanFrame | FdFrame) -> None:
        sent.append(frame)
        left.close()

    left = Session(wire_session(wire).source, Model(), {"can0": send})
    left.tasks += [Echo(), Echo(), Echo()]
    left.arm()
    hear(left, wire, "181#01")
    assert (len(sent), left.withheld) == (1, 2)
    left.source.close()


def test_a_task_sends_on_the_bus_that_it_names(wire: Wire) -> None:
    with new_wire() as other:
        session = open_session([wire.word, other.word], BusOptions(), Model())
        session.tasks.append(Echo(other.name))
        session.arm()
        hear(session, wire, "181#01")
        assert other.next() == "700#"
        assert wire.all() == []
        session.source.close()


def test_the_thread_reads_until_it_is_closed(wire: Wire, session: Session) -> None:
    session.start()
    with wire.calling("181#01"):
        while session.model.frames < 3:
            session.check()
    session.close()
    count = session.model.frames
    assert count >= 3
    session.check()


def test_what_a_task_raises_is_raised_by_check(session: Session) -> None:
    class Broken(Echo):
        def tick(self, now_us: int, records: Sequence[DecodedFrame], /) -> Frames:
            raise ZeroDivisionError

    task = Broken()
    task.due_us = 0
    session.tasks.append(task)
    session.start()
    with pytest.raises(ZeroDivisionError):
        check_for_ever(session)


def test_a_log_has_an_end_and_no_bus_to_send_on() -> None:
    session = drive_session()
    session.arm()
    assert (session.model.frames, session.model.ended, session.armed) == (134, True, False)
    assert session.model.now_us == session.model.trace.tail(1)[0].record.at_us
    session.close()


def test_one_bus_that_cannot_be_opened_closes_the_others(wire: Wire) -> None:
    with pytest.raises(SourceFailed, match="nowhere"):
        open_session([wire.word, "socketcan:nowhere"], BusOptions(), Model())


def test_words_that_name_nothing_are_refused() -> None:
    with pytest.raises(Refused, match="no SOURCE"):
        open_session([], BusOptions(), Model())
    with pytest.raises(Refused, match="cannot be mixed"):
        open_session(["virtual:a", "run.log"], BusOptions(), Model())


def test_options_alone_name_a_bus() -> None:
    session = open_session([], BusOptions(interface="virtual", channel="canmon-alone"), Model())
    with can.Bus(interface="virtual", channel="canmon-alone") as bus:
        bus.send(can.Message(arbitration_id=0x181, is_extended_id=False))
        session.step(PATIENCE_US)
    assert session.model.frames == 1
    session.source.close()
