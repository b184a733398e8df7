from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

import pytest

from tests.host.canmon.model.record_log import hear
from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.node_memory import read_eds_objects
from tickrig.host.canmon.model.node_dictionary import (
    NodeDictionary,
    ObjectRow,
    Origin,
    render_dictionary,
)

EPOS = Path(__file__).parents[5] / "examples/eds/epos.eds"
STATUSWORD = (0x6041, 0)
MAPPED = """\
0.1 605#2F001A0000000000
0.1 585#60001A0000000000
0.1 605#23001A0110004160
0.1 585#60001A0100000000
0.1 605#2F001A0001000000
0.1 585#60001A0000000000
"""


def dictionary(text: str, *, eds: bool = False) -> NodeDictionary:
    decoder = Decoder({5: read_eds_objects(EPOS, 5)} if eds else {})
    made = NodeDictionary(decoder.memory("can0", 5))
    for record in hear(text):
        decoded = decoder.take(record)
        if decoded.node == 5:
            made.take(record.at_us, decoded)
    return made


def values(rows: Iterable[ObjectRow]) -> list[tuple[str, str, Origin, str]]:
    return [(row.text.name, row.value, row.origin, row.trouble) for row in rows]


def test_objects_of_an_eds_have_their_power_on_values() -> None:
    rows = dictionary("", eds=True).rows("1014")
    assert values(rows) == [("cob_id_emcy", "0x00000085", Origin.EDS, "")]


def test_the_later_of_sdo_and_pdo_counts() -> None:
    read = "0.{} 605#4041600000000000\n0.{} 585#4B41600040020000\n"
    pdo = "0.3 185#3702\n"
    earlier = dictionary(MAPPED + read.format(2, 2) + pdo).rows("6041")
    assert values(earlier) == [("statusword", "0x0237[operation enabled]", Origin.PDO, "")]
    later = dictionary(MAPPED + pdo + read.format(4, 4)).rows("6041")
    assert (later[0].value, later[0].origin) == ("0x0240", Origin.SDO)


def test_an_unanswered_read_stands_beside_its_object() -> None:
    made = dictionary(
        "0.1 605#4000100000000000\n0.9 605#4018100100000000\n1.0 585#4318100100000000"
    )
    (row,) = made.rows("1000")
    assert (row.value, row.trouble) == ("", "unanswered")


def test_an_abort_that_names_no_object_is_passed_over() -> None:
    assert dictionary("0.1 585#0011223344556677").rows() == []


def test_data_types_are_no_objects_of_the_node() -> None:
    assert {row.entry[0] for row in dictionary("", eds=True).rows()} & set(range(0x1000)) == set()


def test_rows_are_chosen_by_name_or_index() -> None:
    made = dictionary("", eds=True)
    assert {row.entry[0] for row in made.rows("heartbeat")} >= {0x1017}
    assert [row.entry for row in made.rows("1018h:02")] == [(0x1018, 2)]
    assert made.rows("no such object") == []


TABLE = """\
OBJECT    NAME           VALUE                FROM     AGE  TYPE
1017h:00  heartbeat_time 100                  sdo    1.0 s  UNSIGNED16
6041h:00  statusword     0x0240               sdo    0.9 s  object is read only (06010002h)"""


def test_objects_are_shown_like_this() -> None:
    made = dictionary(
        "0.1 605#2B17100064000000\n0.1 585#6017100000000000\n"
        "0.2 605#4041600000000000\n0.2 585#4B41600040020000\n"
        "0.2 605#2B41600000000000\n0.2 585#8041600002000106"
    )
    assert "\n".join(render_dictionary(made.rows(), 1_100_000)) == TABLE


@pytest.mark.parametrize("width", [76, 116, 196])
def test_names_are_as_long_as_the_screen_lets_them_be(width: int) -> None:
    made = dictionary("", eds=True)
    lines = render_dictionary(made.rows(), 0, width)
    head = lines[0]
    assert all(line[head.index("VALUE") - 1] == " " for line in lines)
    assert max(map(len, lines)) <= width
    assert any("…" in line for line in lines) is (width < 196)
