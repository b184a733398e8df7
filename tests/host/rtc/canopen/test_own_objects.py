"""The server as a node that others may read."""

from __future__ import annotations

import pytest

from tests.emulators.can.can_bench import frames
from tests.host.rtc.canopen.bench import PALETTE_AND_MOTOR, Bench
from tickrig.host.rtc.canopen.definition_reader import parse_definition
from tickrig.host.rtc.canopen.server import ServerObjects

DEFINITION = parse_definition(
    "nodes:\n- {id: 16, name: A, eds: a}\n- {id: 32, name: B, eds: a, heartbeat_ms: 30000}\n"
)


@pytest.mark.parametrize(
    ("request_", "answer"),
    [
        ("4000100000000000", "43001000CC010000"),  # K18
        ("4001100000000000", "4F01100000000000"),
        ("4005100000000000", "4305100080000000"),
        ("4006100000000000", "4306100000000000"),
        ("4016100000000000", "4F16100002000000"),
        ("4016100100000000", "431610012C011000"),  # K14: 16 · 65536 + 300
        ("4016100200000000", "43161002FFFF2000"),
        ("4017100000000000", "4B17100064000000"),
        ("4018100100000000", "4318100100000000"),
        ("4018100200000000", "8018100211000906"),
        ("4008100000000000", "8008100000000206"),
        ("2B17100064000000", "8017100002000106"),
        ("2B17100164000000", "8017100111000906"),
        ("A000100000000000", "8000000001000405"),
        ("6000000000000000", "8000000001000405"),
        ("8000100000000000", None),
        ("E000100000000000", None),
        ("4000", None),
    ],
)
def test_an_object_of_the_server_is_read_and_nothing_is_written(
    request_: str, answer: str | None
) -> None:
    said = ServerObjects(DEFINITION).answer(bytes.fromhex(request_))
    assert (said and said.hex().upper()) == answer


def test_the_server_answers_on_the_bus_by_its_node_id() -> None:
    bench = Bench(PALETTE_AND_MOTOR + "master: {node: 126}\n")
    bench.run_ms(50)
    bench.other.send(frames("67E#4000100000000000"))
    bench.run_ms(5)
    assert "5FE#43001000CC010000" in [str(heard) for _, heard in bench.log.heard]


def test_the_objects_say_that_the_server_sends_sync() -> None:
    definition = parse_definition("master: {sync_ms: 20}\nnodes: [{id: 16, name: A, eds: a}]\n")
    said = [
        ServerObjects(definition).answer(bytes.fromhex(request)) or b""
        for request in ("4005100000000000", "4006100000000000")
    ]
    assert [data.hex().upper() for data in said] == ["4305100080000040", "43061000204E0000"]
