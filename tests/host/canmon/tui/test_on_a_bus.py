from __future__ import annotations

from collections.abc import Callable

from tests.host.canmon.tui.rig_session import EPOS, NODE
from tickrig.device.canopen.models import epos
from tickrig.emulators.can.outside.interface import CHANNELS
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.canmon.model.decode.node_memory import read_eds_objects
from tickrig.host.canmon.model.transmit import parse_row_text
from tickrig.host.canmon.tui.panels.dictionary_panel import DictionaryTask
from tickrig.host.canmon.tui.panels.transmit_panel import TransmitTask
from tickrig.host.canmon.tui.session import Model, Session, open_session
from tickrig.host.cli.can_options import BusOptions

STEPS = 1_000


def until(session: Session, done: Callable[[], bool]) -> None:
    """Let time pass until something is done."""
    for _ in range(STEPS):
        session.step(1_000)
        if done():
            return
    raise AssertionError("it was not done")


def test_tasks_reach_our_drive_over_an_interface_of_python_can() -> None:
    wire = CanWire()
    rig = Rig(Station(epos.make_epos(NODE), wire.end()))
    with CHANNELS.offer("desk", rig, wire):
        session = open_session(
            ["sim:desk"], BusOptions(), Model({NODE: read_eds_objects(EPOS, NODE)})
        )
        client = DictionaryTask(session.model.decoder)
        sender = TransmitTask(session.model.eds)
        session.tasks += [client, sender]
        until(session, lambda: session.model.frames > 0)  # it has booted
        session.arm()
        (bus,) = session.buses
        client.choose((bus, NODE))
        client.read(session.now_us, (0x1008, 0))
        sender.add(parse_row_text("000#0105"))
        sender.once(0, armed=session.armed)
        until(session, lambda: client.result == "read 1008h:00: done" and session.sent == 2)
        (row,) = client.objects((bus, NODE)).rows("1008")
        session.close()
        session.source.close()
    assert row.value == "'EPOS'"
