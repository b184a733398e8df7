"""The lines of architecture.md, section 4, shown on an RTC-Lite node; and noise."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

from hypothesis import given, settings
from hypothesis import strategies as st

from tests.device.rtc_lite.reference_model import checked
from tickrig.device.rtc_lite.component import LiteA, LiteB, LiteEcho
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.emulators.rig.faults import FaultyPort
from tickrig.emulators.rig.rig import Rig
from tickrig.emulators.rig.station import Station
from tickrig.emulators.rtc_lite.line import LINE_FAULTS
from tickrig.emulators.serial.serial_line import SerialLine
from tickrig.wire.rtc_lite.codes import LiteContextType
from tickrig.wire.rtc_lite.values import LONG

ROOT = Path(__file__).parents[2]
WRITE = checked("PS", b"\x02\x04in" + LONG.encode(42))
DIALOGUE = [
    *(checked("CX"), checked("CI"), checked("AA"), WRITE, checked("AE"), checked("CY", b"\x01")),
    checked("AD"),
]
FRAMES = [
    *DIALOGUE,
    *(checked("AR"), checked("AB"), checked("AC"), checked("CZ"), checked("BW", b"\x2c\x01")),
    *(checked("QG", b"\x03out"), b"\nZz\xd4", b"\nAA\x83", WRITE[:5], WRITE[5:], b"\n", b"x" * 70),
]

waits = st.sampled_from([0, 1, 300, 1_000, 2_500, 10_000, 19_900, 20_100, 99_000, 101_000, 700_000])
START = DIALOGUE[1:3]


@settings(max_examples=100)
@given(st.lists(st.binary(max_size=90), max_size=12), st.sampled_from([1_000, 30_000]))
def test_after_any_noise_and_a_pause_a_dialogue_works(chunks: list[bytes], wait_us: int) -> None:
    line, node = SerialLine(57_600), RtcLiteNode(LiteEcho)
    rig = Rig(Station(node, line.a))
    for chunk in chunks:
        line.b.send(rig.now_us, chunk)
        rig.run_for(wait_us)
    rig.run_for(200_000)

    def ask(request: bytes) -> bytes:
        line.b.poll(rig.now_us)
        line.b.send(rig.now_us, request)
        rig.run_for(20_000)
        return line.b.poll(rig.now_us)

    to_inactive = {"Created": "CI", "Active": "AD", "Error": "AR"}  # a node cannot be finalized
    if (state := str(node.read("state"))) in to_inactive:  # by less than the frame CF
        assert ask(checked(to_inactive[state])) == checked(to_inactive[state], b"@I")
    assert ask(checked("AA")) == checked("AA", b"@A")
    assert ask(WRITE) == checked("PS", b"@")
    assert ask(checked("AE")) == checked("QV", b"\x03\x04out*\0\0\0") + checked("AE", b"@A")


@settings(max_examples=50)
@given(st.data())
def test_truncated_and_doubled_frames_never_stop_the_node(data: st.DataObject) -> None:
    line, node = SerialLine(57_600), RtcLiteNode(LiteEcho)
    rig = Rig(Station(node, line.a))
    for frame in data.draw(st.lists(st.sampled_from(FRAMES), max_size=12)):
        cut = data.draw(st.integers(0, len(frame)))
        line.b.send(rig.now_us, data.draw(st.sampled_from([frame[:cut], frame * 2, frame[cut:]])))
        rig.run_for(data.draw(waits))
    rig.run_for(200_000)
    line.b.poll(rig.now_us)
    line.b.send(rig.now_us, checked("CY", b"\x07"))
    rig.run_for(20_000)
    assert line.b.poll(rig.now_us) == checked("CY", b"@\x07")


def chain(order: int) -> str:
    """Let a host carry what LiteA says to LiteB, under noise; return all that was on both lines."""
    timer = LiteConfig(context=LiteContextType.TIMER, rate_hz=170)
    nodes = RtcLiteNode(LiteA, timer), RtcLiteNode(LiteB, timer)
    lines = SerialLine(57_600), SerialLine(9_600)
    ports = [FaultyPort(line.a, LINE_FAULTS, seed) for seed, line in enumerate(lines)]
    stations = [Station(node, port) for node, port in zip(nodes, ports, strict=True)]
    rig, log = Rig(*stations[order:], *stations[:order]), list[str]()
    for number in range(120):
        if number == len(START):
            ports[1].arm("noise", "0.02")
        frame = START[number] if number < len(START) else FRAMES[number % len(FRAMES)]
        lines[0].b.send(rig.now_us, frame)
        rig.run_for(9_000 + 21_000 * (number % 9 == 0))
        said = [line.b.poll(rig.now_us) for line in lines]
        lines[1].b.send(rig.now_us, said[0].replace(b"QV\x03\x04out", b"PS\x02\x04in"))
        log.append(f"{rig.now_us} {said} {[node.read('state') for node in nodes]}")
    assert {"QV" in entry for entry in log} == {True, False}
    return "\n".join(log)


def test_the_order_of_listing_makes_no_difference() -> None:
    assert chain(0) == chain(1)


def test_a_run_is_the_same_in_another_process_and_under_another_hash_seed() -> None:
    program = "from tests.properties.test_rtc_lite_determinism import chain; print(chain(0))"
    path = os.pathsep.join([str(ROOT / "src"), str(ROOT)])
    runs = [
        subprocess.Popen(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONHASHSEED": seed, "PYTHONPATH": path},
            stdout=subprocess.PIPE,
            text=True,
        )
        for seed in ("0", "1")
    ]
    said = [run.communicate(timeout=60)[0].strip() for run in runs]
    assert said == [chain(0)] * 2
