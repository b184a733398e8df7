"""Any traffic: no task raises, and what it keeps can be shown."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.decode.test_noise import CAN_IDS, ERRORS, REMOTE, SDO, WIDE
from tests.host.canmon.model.strategies import data_frame
from tickrig.host.canmon.model.check.checker import render_alarms
from tickrig.host.canmon.model.check.rules import parse_rules
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.graph.plot import LiveGraph, ViewMode
from tickrig.host.canmon.model.graph.series import parse_signal
from tickrig.host.canmon.model.node_dictionary import render_dictionary
from tickrig.host.canmon.tui.panels.alarms_panel import AlarmTask
from tickrig.host.canmon.tui.panels.dictionary_panel import DictionaryTask
from tickrig.host.canmon.tui.panels.graph_panel import GraphTask
from tickrig.host.canmon.tui.panels.sequence_panel import SequenceTask
from tickrig.host.canmon.tui.session import Model
from tickrig.wire.can import CanFrame, ErrorFrame

ANY = st.builds(data_frame, CAN_IDS, st.binary(max_size=8))
FRAMES = st.lists(st.one_of(SDO, SDO, ANY, REMOTE, WIDE, ERRORS), max_size=60)
BUS, NODE = "can0", 5
RULES = {"no_sdo_abort": True, "no_emcy": True, "no_reboot": True, "nodes": 9, "known": "705"}
WAITING = '[[step]]\nrepeat = "forever"\nsteps = [{expect = "node=5 and sdo", on-fail = "go-on"}]'


@given(FRAMES, st.booleans())
def test_whatever_is_heard_can_be_shown(
    frames: list[CanFrame | ErrorFrame], downloading: bool
) -> None:
    model = Model()
    objects, alarms, sequence = DictionaryTask(model.decoder), AlarmTask(model), SequenceTask({})
    graph = LiveGraph(ViewMode.ALL)
    graph.add(parse_signal("185[0:2]s"))
    graph.add(parse_signal("5.statusword@2"))
    alarms.hold(parse_rules(RULES))
    sequence.start(sequence.parse(WAITING, "noise"))
    objects.choose((BUS, NODE))
    if downloading:
        objects.write(0, (0x2000, 0), bytes(20))
    else:
        objects.read(0, (0x1008, 0))
    for number, frame in enumerate(frames, 1):
        decoded_frames = model.take([Record(number * 100_000, BUS, frame)])
        for task in (objects, alarms, sequence, GraphTask(graph)):
            task.tick(number * 100_000, decoded_frames)
    assert render_dictionary(objects.objects((BUS, NODE)).rows(), model.now_us)
    assert render_alarms(alarms.alarms, model.now_us)
    assert len(graph.render(60, 12)) == 12
