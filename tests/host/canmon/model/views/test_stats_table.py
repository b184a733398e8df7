from __future__ import annotations

import json

from tests.host.canmon.model.record_log import hear, snapshot
from tickrig.host.canmon.verbs.stats import (
    bus_json,
    bus_lines,
    by_id,
    by_node,
    id_json,
    node_json,
    node_rows,
)

LOG = hear(
    "\n".join(f"{0.01 * n:.2f} 181#{n:02X}" for n in range(50) if n not in (20, 21))
    + "\n0.5 701#05\n0.6 080#\n0.7 20000140#0000000000000000\n0.65 281#R8"
)

IDS = """\
bus   CAN-ID  frames    1/s  share %  min ms  avg ms  p99 ms  max ms  jitter  cycle ms  missed  bits
can0  080          1   0.00      1.7       -       -       -       -       -         -       -     0
can0  181         48  95.92     94.6  10.000  10.425  30.000  30.000   0.869    10.000       2     6
can0  701          1   0.00      2.0       -       -       -       -       -         -       -     0
can0  281R         1   0.00      1.7       -       -       -       -       -         -       -     0"""  # noqa: E501 - as wide as it is

NODES = """\
bus   node  CAN-IDs  frames    1/s  share %
can0  1           3      50  76.92     98.3
can0  -           1       1   1.54      1.7"""


def test_the_table_of_identifiers() -> None:
    assert "\n".join(by_id(snapshot(LOG))) == IDS


def test_the_table_of_nodes() -> None:
    assert "\n".join(by_node(snapshot(LOG))) == NODES


def test_what_a_bus_did() -> None:
    assert bus_lines(snapshot(LOG).buses[0], 10_000) == [
        "can0: 51 frames in 0.650000 s, 2924 bits with stuff bits",
        "  load: mean 45.0 %, peak 45.0 % in 0.650000 s from 0.000000",
        "  error frames: 1",
        "    1 x bus-off, restarted",
        "  controller: bus-off",
        "  back in time: 1 frames",
    ]


def test_a_bus_of_error_frames_alone_has_no_shares() -> None:
    found = snapshot(hear("0 20000020#0000000000000000"))
    assert len(by_id(found)) == len(by_node(found)) == 1


def test_a_bus_as_json() -> None:
    said = json.loads(bus_json(snapshot(LOG).buses[0], 10_000))
    assert (said["v"], said["what"], said["ch"], said["n"]) == (1, "bus", "can0", 51)
    assert (said["mean_load"], said["errors"], said["went_back"]) == (0.4498, 1, 1)
    assert json.loads(bus_json(snapshot(LOG).buses[0], None))["peak_load"] is None


def test_an_identifier_as_json() -> None:
    rows = {row.ident & 0x7FF: json.loads(id_json(row)) for row in snapshot(LOG).rows}
    assert rows[0x181]["gaps"] == {
        "min_us": 10_000,
        "mean_us": 10_425,
        "p99_us": 30_000,
        "max_us": 30_000,
        "jitter_us": 869,
        "cycle_us": 10_000,
        "missed": 2,
    }
    assert (rows[0x181]["id"], rows[0x181]["x"], rows[0x181]["data"]) == (0x181, 0, "31")
    assert (rows[0x281]["rtr"], rows[0x281]["gaps"], rows[0x281]["changes"]) == (1, None, [])


def test_a_node_as_json() -> None:
    node, rest = (json.loads(node_json(row)) for row in node_rows(snapshot(LOG).rows))
    assert (node["node"], node["n"]) == (1, 50)
    assert node["ids"][0] == {"id": 0x181, "x": 0}
    assert (rest["node"], rest["ids"]) == (None, [{"id": 0x080, "x": 0}])
