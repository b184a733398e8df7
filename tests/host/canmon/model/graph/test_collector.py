from __future__ import annotations

import re
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tests.host.canmon.model.decode.drive_trace import GOLDEN
from tickrig.host.canmon.model.columns.column_reader import read_columns
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.graph.series import Collector, parse_signal
from tickrig.host.canmon.model.logs.log_reader import read_log
from tickrig.wire.can import NO_ACK, CanFrame

DBC = GOLDEN / "engine.dbc"
EPOS = Path(__file__).parents[5] / "examples/eds/epos.eds"
LOG = """\
(1600000000.000000) can0 181#3702FEFFFFFF
(1600000000.001000) can1 00000181#01
(1600000000.002000) can0 181#R
(1600000000.003000) can0 20000020#0000000000000000
(1600000000.004000) can0 181#370202000000
(1600000000.005000) can0 181#3702
(1600000000.006000) can0 281#0000C07F
(1600000000.007000) can0 281#0000C03F
"""


def collected(*words: str, eds: dict[int, Path] | None = None) -> Collector:
    return Collector([parse_signal(word) for word in words], Decoder(eds or {}))


def record(*texts: str) -> list[Record]:
    return [Record(n * 1_000, "can0", CanFrame.parse(text)) for n, text in enumerate(texts)]


def test_a_slice_is_taken_of_each_data_frame_that_holds_it() -> None:
    collector = collected("181[2:6]s", "00000181[0]", "mode=181[0]@2")
    collector.take_all(record("181#3702FEFFFFFF", "00000181#07", "181#R", "181#3702"))
    collector.take(Record(9, "can0", NO_ACK))
    assert [list(one.values) for one in collector.series] == [[-2], [7], [0x37, 0x37]]
    assert [(one.label, one.axis) for one in collector.series] == [
        ("181[2:6]s", 1),
        ("00000181[0]", 1),
        ("mode", 2),
    ]


def test_an_object_is_taken_by_its_name_or_how_that_begins() -> None:
    collector = collected("5.position", "5.statusword.fault", "s=5.status", eds={5: EPOS})
    frames = record("185#3F020A000000", "185#37020B000000", "185#3702", "186#37020C000000")
    collector.take_all(frames)
    position, fault, status = collector.series
    assert [list(one.values) for one in (fault, status)] == [[1, 0], [0x23F, 0x237]]
    assert (position.label, list(position.values)) == ("5.position_actual_value", [10, 11])
    assert (fault.label, status.label) == ("5.statusword.fault", "s")


def test_a_name_that_began_with_one_object_keeps_to_it() -> None:
    collector = collected("5.target", eds={5: EPOS})
    velocity = ("605#40FF600000000000", "585#43FF6000E8030000")
    position = ("605#407A600000000000", "585#437A600001000000")
    collector.take_all(record(*velocity, *position, *velocity))
    (target,) = collector.series
    assert (target.label, list(target.values)) == ("5.target_velocity", [1_000, 1_000])


def test_a_name_alone_means_the_first_node_that_has_it() -> None:
    collector = collected("position", "statusword.fault", eds={5: EPOS, 6: EPOS})
    collector.take_all(record("185#37020A000000", "186#37020B000000"))
    assert [(one.label, list(one.values)) for one in collector.series] == [
        ("5.position_actual_value", [10]),
        ("5.statusword.fault", [0]),
    ]


def test_a_signal_of_a_dbc_file_has_a_curve_with_its_unit() -> None:
    collector = Collector([parse_signal("speed")], Decoder(dbc=[DBC]))
    collector.take_all(record("123#E8030100", "123#E803"))
    (speed,) = collector.series
    assert (speed.label, speed.unit, list(speed.values)) == ("Speed", "rpm", [500, 500])


def test_a_log_as_columns_gives_the_same(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    path.write_text(LOG)
    words = ("181[2:6]s*0.5", "00000181[0]", "281[0:4]f", "281[3]")
    one_by_one, at_once = collected(*words), collected(*words)
    one_by_one.take_all(read_log(path))
    for block in read_columns(path):
        at_once.take_columns(block)
    assert one_by_one.series == at_once.series
    assert [list(one.values) for one in at_once.series[:3]] == [[-1, 1], [1], [1.5]]
    assert at_once.series[2].not_numbers == 1


def test_what_is_no_number_has_no_curve() -> None:
    collector = collected("5.manufacturer", "6.manufacturer", eds={5: EPOS, 6: EPOS})
    collector.take_all(record("605#4008100000000000", "585#4308100041424344"))
    five, six = collector.series
    assert (five.label, len(five)) == ("5.manufacturer_device_name", 0)
    assert (six.label, len(six)) == ("6.manufacturer", 0)


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is not [LABEL=]SIGNAL[@AXIS]"),
        ("181[0]@0", "is not [LABEL=]SIGNAL[@AXIS]"),
        ("3.", "'3.' is neither an object, as 3.position, nor a slice"),
        ("200.position", "'200.position' is neither an object"),
        ("a=181[x]", "'181[x]' is not ID[BYTES]TYPE"),
    ],
)
def test_what_is_no_signal_is_refused(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=re.escape(said)):
        parse_signal(text)


@given(st.text("0123456789ABCabf[]:.+*/-=@us ", max_size=20) | st.text(max_size=20))
def test_any_text_is_a_signal_or_refused(text: str) -> None:
    try:
        parse_signal(text)
    except ValueError as error:
        assert str(error)  # noqa: PT017 - either is right


def test_signals_come_and_go_while_others_go_on() -> None:
    collector = Collector([parse_signal("181[0]")])
    collector.take(Record(1, "can0", CanFrame.parse("181#07")))
    collector.join(Collector([parse_signal("181[0]*2"), parse_signal("5.position")]))
    collector.take(Record(2, "can0", CanFrame.parse("181#08")))
    assert [list(series.values) for series in collector.series] == [[7, 8], [16], []]
    collector.remove(2)
    collector.remove(0)
    collector.take(Record(3, "can0", CanFrame.parse("181#09")))
    assert [list(series.values) for series in collector.series] == [[16, 18]]
