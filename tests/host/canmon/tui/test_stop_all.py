from __future__ import annotations

from tests.host.canmon.tui.rig_session import BUS, RigSession
from tickrig.host.canmon.model.transmit import parse_row_text
from tickrig.host.canmon.tui.panels.transmit_panel import TransmitTask
from tickrig.host.cli.messages import SourceFailed
from tickrig.wire.can import CanFrame, FdFrame


def sending(frames: int) -> RigSession:
    """A session that is to send some frames at once."""
    session = RigSession()
    task = TransmitTask({})
    session.tasks.append(task)
    session.arm()
    task.add(parse_row_text("080#"))
    for _ in range(frames):
        task.once(0, armed=True)
    return session


def test_what_is_due_already_is_not_sent_after_a_stop() -> None:
    session = sending(3)
    put = session.buses[BUS]

    def stopping(frame: CanFrame | FdFrame) -> None:
        put(frame)
        session.disarm()

    session.buses[BUS] = stopping
    session.step()
    assert (session.frames, session.sent, session.withheld) == (["080#"], 1, 2)


def test_a_bus_that_fails_is_not_tried_again() -> None:
    session = sending(3)
    tried: list[CanFrame | FdFrame] = []

    def failing(frame: CanFrame | FdFrame) -> None:
        tried.append(frame)
        raise SourceFailed("can0 is down")

    session.buses[BUS] = failing
    session.step()
    assert (len(tried), session.armed, session.trouble) == (1, False, "can0 is down")
