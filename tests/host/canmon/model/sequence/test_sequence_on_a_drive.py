from __future__ import annotations

from pathlib import Path

from tickrig.device.canopen.models import epos
from tickrig.emulators.can.outside.host import CanHost
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.host.canmon.model.decode.node_memory import read_eds_objects
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.sequence import EventType, SequenceRun, TomlSequence
from tickrig.host.canmon.model.transmit import PdoFrames
from tickrig.host.canmon.verbs.seq import ConditionDecoder
from tickrig.wire.can import Frames

EXAMPLES = Path(__file__).parents[5] / "examples"
START = EXAMPLES / "sequences/start_drive.toml"


def carried_out(text: str) -> tuple[SequenceRun, epos.Epos]:
    """Carry out a sequence on our drive, in virtual time."""
    wire = CanWire()
    slave = epos.make_epos(5)
    drive = epos.Epos.of(slave)
    host = CanHost(Rig(Station(slave, wire.end())), wire.end())
    watch = ConditionDecoder({5: read_eds_objects(EXAMPLES / "eds/epos.eds", 5)})
    resolve = PdoFrames(watch.eds).frame
    sequence = TomlSequence(text, START.name, resolve=resolve, condition=watch.condition).parse()
    run = SequenceRun(sequence)

    def send(frames: Frames) -> None:
        host.send(frames)
        for frame in frames:
            watch.take(Record(host.now_us, "can0", frame, sent=True))

    send(run.tick(host.now_us))
    while not run.done:
        for frame in host.receive(run.due_us - host.now_us):
            record = Record(host.now_us, "can0", frame)
            watch.take(record)
            send(run.tick(host.now_us, (record,)))
        send(run.tick(host.now_us))
    return run, drive


def test_the_example_turns_our_drive() -> None:
    run, drive = carried_out(START.read_text())
    assert [event.text for event in run.events if event.mark is EventType.MISSED] == []
    assert (run.done, run.met) == (True, 5)
    assert drive.read("shaft_deg") != 0


def test_an_answer_by_sdo_is_expected_by_the_name_of_its_object() -> None:
    text = """
    [[step]]
    expect = "705#00"
    [[step]]
    send = "605#4000100000000000"
    [[step]]
    expect = "device_type=0x20192"
    within = "20ms"
    """
    run, _ = carried_out(text)
    assert [event.text for event in run.events][-1] == "2 met, 0 missed"


def test_a_drive_that_is_not_there_is_missed() -> None:
    run, drive = carried_out(START.read_text().replace("id = 5", "id = 6").replace("{id}.r", "5.r"))
    assert (run.met, run.missed) == (0, 1)
    assert drive.read("shaft_deg") == 0
