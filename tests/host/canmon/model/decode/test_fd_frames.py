"""CAN FD frames among CANopen: decoded as none of its services, filtered, kept apart."""

from __future__ import annotations

from pathlib import Path

import pytest

from tickrig.host.canmon.model.decode.decoder import Decoder
from tickrig.host.canmon.model.decode.filter import parse_filter
from tickrig.host.canmon.model.frames import Record
from tickrig.host.canmon.model.logs.notation import parse_frame

FRAMES = "705##105 705#05 123##0 00000123##3" + "11" * 64 + " 081##28130 123#11"


def heard(text: str) -> list[Record]:
    return [Record(at_us, "can0", parse_frame(one)) for at_us, one in enumerate(text.split())]


def test_a_can_fd_frame_is_no_canopen_service() -> None:
    decoder = Decoder()
    decoded = [decoder.take(one) for one in heard("705##17F 705#05 081##18130")]
    assert [one.kind for one in decoded] == ["fd", "heartbeat", "fd"]
    assert decoded[0].text == "no CANopen service"


def test_signals_of_a_dbc_file_are_decoded(tmp_path: Path) -> None:
    path = tmp_path / "fd.dbc"
    path.write_text(
        'VERSION ""\nBU_: A\nBO_ 291 Wide: 64 A\n SG_ last : 504|8@1+ (1,0) [0|0] "" A\n'
    )
    decoded = Decoder(dbc=[path]).take(heard("123##1" + "00" * 63 + "2A")[0])
    assert [(one.name, one.value) for one in decoded.signals] == [("last", 42)]


@pytest.mark.parametrize(
    ("text", "places"),
    [
        ("fd", [0, 2, 3, 4]),
        ("not fd", [1, 5]),
        ("brs", [0, 3]),
        ("esi", [3, 4]),
        ("fd and bytes > 8", [3]),
        ("bytes = 1", [0, 1, 5]),
        ("dlc = 15", [3]),
        ("123", [2, 5]),
        ("00000123-00000200", [3]),
        ("123:7FF,705:7FF", [0, 1, 2, 3, 5]),
        ("id = 123 and not fd", [5]),
        ("heartbeat", [1]),
    ],
)
def test_a_filter_passes_what_it_says(text: str, places: list[int]) -> None:
    wanted, decoder = parse_filter(text), Decoder()
    passed = [one.at_us for one in heard(FRAMES) if wanted.matches(one, decoder.take(one))]
    assert passed == places
