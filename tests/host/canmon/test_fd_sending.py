"""CAN FD sent and played, bit rates on the command line, and who takes no CAN FD."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import can
import pytest
from click.testing import CliRunner, Result

from tickrig.host.canmon.cli import main
from tickrig.host.canmon.model.traffic import BitRates
from tickrig.host.canmon.output.listening import bit_rates_of
from tickrig.host.canmon.sources.bus_source import Transmitter, merged
from tickrig.host.canmon.sources.source import BusSpec, parse_source
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import SourceFailed
from tickrig.host.links.can_link import to_fd_frame, to_frame
from tickrig.wire.can import CanFrame, FdFrame

LOG = """\
(1600000000.000000) can0 123##1AABB
(1600000000.001000) can0 00000123##3{wide}
(1600000000.002000) can0 20000020#0000000000000000
(1600000000.003000) can0 181#0102
""".format(wide="5A" * 64)


@pytest.fixture
def heard() -> Iterator[can.BusABC]:
    with can.Bus(interface="virtual", channel="canmon-fd") as bus:
        yield bus


def canmon(*words: str) -> Result:
    return CliRunner().invoke(main, words)


def all_of(bus: can.BusABC) -> list[str]:
    found = []
    while (message := bus.recv(0)) is not None:
        found.append(str(to_frame(message) or to_fd_frame(message)))
    return found


def test_frames_of_can_fd_are_sent_and_filled_up(heard: can.BusABC) -> None:
    result = canmon("send", "virtual:canmon-fd", "123##1AABB", "00000123##0" + "11" * 9, "123#AABB")
    assert result.exit_code == 0, result.output
    sent = ["123##1AABB", "00000123##0" + "11" * 9 + "000000", "123#AABB"]
    assert all_of(heard) == sent
    assert [line.split()[-1] for line in result.stdout.splitlines()] == sent


def test_counters_and_checksums_reach_64_bytes(heard: can.BusABC) -> None:
    fields = ("--counter", "62:1..2", "--checksum", "63:xor")
    words = ("123##1" + "00" * 64, *fields, "--every", "1ms", "--count", "2", "-q")
    assert canmon("send", "virtual:canmon-fd", *words).exit_code == 0
    assert all_of(heard) == ["123##1" + "00" * 62 + tail for tail in ("0101", "0202")]


@pytest.mark.parametrize(
    ("frame", "said"),
    [
        ("123##", "'123##' is not a CAN FD frame like 123##1AABB"),
        ("123##1" + "00" * 65, "a CAN FD frame of 65 bytes, at most 64 fit"),
        ("800##1", "CAN-ID 0x800 is not 11-bit"),
    ],
)
def test_what_is_no_frame_of_can_fd_is_refused(frame: str, said: str) -> None:
    result = canmon("send", "virtual:canmon-fd", frame)
    assert (result.exit_code, result.stderr.splitlines()[-1]) == (2, f"Error: {said}")


def test_a_log_with_can_fd_is_played(heard: can.BusABC, tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    path.write_text(LOG)
    result = canmon("play", str(path), "virtual:canmon-fd", "--speed", "max")
    assert result.stderr.endswith("; 1 left out\n")
    assert all_of(heard) == ["123##1AABB", "00000123##3" + "5A" * 64, "181#0102"]


def test_a_driver_that_was_not_opened_for_can_fd_is_sent_none(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    out = Transmitter("virtual:canmon-fd", BusOptions())
    monkeypatch.setattr(out, "_takes_fd", False)
    with pytest.raises(SourceFailed, match="cannot send 123##1 on canmon-fd: CAN FD wants --fd"):
        out.send(FdFrame(0x123, flags=1))
    out.send(CanFrame(0x123))
    out.close()


def test_a_source_word_may_name_both_bit_rates() -> None:
    word = parse_source("pcan:PCAN_USBBUS1@500k/2M")
    assert isinstance(word, BusSpec)
    options = merged(word, BusOptions())
    assert (options.bitrate, options.data_bitrate, options.fd) == (500_000, 2_000_000, True)
    assert bit_rates_of(["can0@500k/2M"], BusOptions()) == BitRates(500_000, 2_000_000)
    given = BusOptions(bitrate=250_000, data_bitrate=4_000_000)
    assert bit_rates_of(["can0@500k/2M"], given) == BitRates(250_000, 4_000_000)


def test_bit_rates_of_the_command_line_are_read_with_k_and_m(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    path.write_text(LOG)
    without = canmon("stats", str(path), "-b", "500k").stdout.splitlines()
    assert without[2] == "  CAN FD: 2 frames; 2 have BRS with an unknown rate: the load is lower"
    words = ("-b", "500k", "--data-bitrate", "2M")
    assert canmon("stats", str(path), *words).stdout.splitlines()[2] == "  CAN FD: 2 frames"
    wrong = canmon("stats", str(path), "-b", "fast")
    assert wrong.stderr.endswith("'fast' is not a bit rate like 500000, 500k or 1M\n")


def test_a_limit_of_the_load_takes_the_data_bit_rate(tmp_path: Path) -> None:
    path = tmp_path / "run.log"
    wide = "123##1" + "5A" * 64
    path.write_text("".join(f"(1.{n:06d}) can0 {wide}\n" for n in range(0, 999_000, 1_000)))
    words = ("check", str(path), "--max-load", "60", "-b", "500k")
    assert canmon(*words).exit_code == 1
    assert canmon(*words, "--data-bitrate", "4M").exit_code == 0
