"""The demonstration of Fig. 120, as a user runs it."""

from __future__ import annotations

import json
import time
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from tests.interop.buses import GROUP
from tickrig.emulators.can.end import CanEnd
from tickrig.emulators.can.outside.sim_network import SimNetwork
from tickrig.emulators.commands.cli import main
from tickrig.emulators.demos import fig120 as stage_module
from tickrig.emulators.demos.fig120 import CAST, CurveSample, VirtualStage, run_demo, set_up
from tickrig.emulators.rig.rig import Rig

GOLDEN = Path(__file__).parents[2] / "golden/canopen/fig120.json"
ANGLES = (45.0014, 90.0027, 134.9602, 179.9615)
RESOLUTION_DEG = 360 / 200_000


def fig120(*words: str) -> Result:
    return CliRunner().invoke(main, ["demo", "fig120", *words])


@pytest.fixture(scope="module")
def samples() -> list[CurveSample]:
    return run_demo(VirtualStage(), lambda text: None)


def test_the_motor_takes_every_angle_of_the_table(samples: list[CurveSample]) -> None:
    references = {round(sample.reference_deg, 4) for sample in samples if sample.time_s < 3}
    assert references == {0.0, *ANGLES}
    for end_s, angle_deg in zip((1.2, 1.8, 2.4, 3.0), ANGLES, strict=True):
        last = [sample for sample in samples if sample.time_s < end_s][-1]
        assert last.angle_deg == pytest.approx(angle_deg, abs=RESOLUTION_DEG)


def test_the_master_sends_the_frames_of_the_report() -> None:
    golden = json.loads(GOLDEN.read_text("utf-8"))["fig120_setup"]
    wanted = [f"{frame['id']}#{frame['data'].replace(' ', '')}" for frame in golden]
    stage, seen = VirtualStage(), list[str]()
    stage.wire.observers.append(lambda at_us, frame: seen.append(str(frame)))
    set_up(stage.network)
    stage.run_to(stage.now_us + 2_000)
    assert [text for text in seen if text[0] != "7"][: len(wanted) - 4] == [
        text for text in wanted if text[0] != "7"
    ]


def test_it_runs_the_same_each_time(samples: list[CurveSample]) -> None:
    assert run_demo(VirtualStage(), lambda text: None) == samples


def test_the_table_shows_the_pdo_and_when_the_shaft_arrived() -> None:
    result = fig120()
    assert result.exit_code == 0, result.output
    assert "The master has left the bus." in result.output
    assert "   00 40         90.0027     90.0024" in result.output
    assert "The shaft rests at 90.0024 deg, 0.229 s after the step." in result.output


@pytest.mark.parametrize(
    ("name", "begin"), [("a.png", b"\x89PNG"), ("a.svg", b"<?xml"), ("a.html", b"<!DOCTYPE html>")]
)
def test_the_curves_are_drawn(tmp_path: Path, name: str, begin: bytes) -> None:
    result = fig120("--plot", str(tmp_path / name))
    assert result.exit_code == 0, result.output
    assert (tmp_path / name).read_bytes().startswith(begin)


@pytest.mark.parametrize(
    ("words", "reason"),
    [
        (("--plot", "a.doc"), "--plot a.doc: the name ends in .png, .svg, .html"),
        (("--plot", "none/a.png"), "--plot none/a.png: no directory none"),
        (("--plot", "/proc/a.png"), "--plot /proc/a.png: No such file or directory"),
        (("-i", "virtual"), "virtual is inside one process, and the nodes run in another"),
    ],
)
def test_what_cannot_be_done_is_said_before_anything_moves(
    words: tuple[str, ...], reason: str
) -> None:
    result = fig120(*words)
    assert (result.exit_code, result.output) == (2, f"Error: {reason}\n")


class LateNetwork(SimNetwork):
    """Delivers each SDO answer 400 ms late."""

    def __init__(self, rig: Rig, end: CanEnd) -> None:
        super().__init__(rig, end)
        self._held: list[tuple[float, int, bytearray]] = []

    def notify(self, can_id: int, data: bytearray, timestamp: float) -> None:
        if can_id - 0x580 in CAST:
            self._held.append((timestamp + 0.4, can_id, data))
        else:  # a heartbeat, of which there is one each 100 ms
            super().notify(can_id, data, timestamp)
        while self._held and self._held[0][0] <= timestamp:
            _, answer_id, answer = self._held.pop(0)
            super().notify(answer_id, answer, timestamp)


def test_nodes_that_answer_late_are_set_up_all_the_same(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(stage_module, "SimNetwork", LateNetwork)
    stage = VirtualStage()
    samples = run_demo(stage, lambda text: None)
    assert max(sample.reference_deg for sample in samples) == pytest.approx(ANGLES[-1], abs=1e-4)


@pytest.mark.realtime
def test_it_runs_in_real_time_on_a_bus_of_python_can() -> None:
    start = time.monotonic()
    result = fig120("-i", "udp_multicast", "-c", GROUP)
    assert result.exit_code == 0, result.output
    assert 5 < time.monotonic() - start < 50
    assert "The shaft rests at 179.96" in result.output
