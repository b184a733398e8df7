from __future__ import annotations

import json
from pathlib import Path

from click.testing import CliRunner

from tests.emulators.testing.bench.test_plan_parts import BUS, drive, plan_of
from tickrig.device.canopen.models.epos import make_epos
from tickrig.device.rrc.machine import Rrc
from tickrig.device.rrc.settings import RrcConfig
from tickrig.emulators.canopen.store_file import FORMAT
from tickrig.emulators.commands.cli import main
from tickrig.emulators.testing.bench.bench import Bench
from tickrig.emulators.testing.rig_file.plan import DeviceKind, DevicePlan

EDS = Path(__file__).parents[3] / "golden" / "canopen" / "r1.eds"
EXAMPLES = Path(__file__).parents[4] / "examples"


def replayed(bench: Bench, path: Path, *words: str) -> str:
    bench.save_trace(path)
    return CliRunner().invoke(main, ["replay", str(path), *words]).output


def test_the_bench_of_a_rig_file_replays_with_what_it_began_with(tmp_path: Path) -> None:
    store = tmp_path / "store.json"
    stored = {"parameters": {"1017:00": "1400"}, "node_id": None, "bit_rate_index": None}
    store.write_text(json.dumps({"format": FORMAT, "nodes": {"io": stored}}))
    io = DevicePlan(
        name="io",
        kind=DeviceKind.EDS,
        type=str(EDS),
        wire="bus",
        node_id=9,
        profile="401",
        store=store,
        start={"0x6000:1": 5},
    )
    lite = DevicePlan(
        name="pic", kind=DeviceKind.SERIAL, type="rtc-lite", wire="pic", config={"node": "lite-a"}
    )
    plan = plan_of(io, drive("left", 5, start={"load_nm": 0.25}), lite, wires=(BUS,))
    with Bench.of_plan(plan) as bench:
        bench.run_for("100ms")
        bench.fault("left/power_off")
        bench.run_for("100ms")
        output = replayed(bench, tmp_path / "run.trace")
    text = (tmp_path / "run.trace").read_text()
    assert output.startswith("identical: ")
    assert "0.001000 io ! 0x6000:1=5\n" in text
    assert '"sha256": "' in text
    assert text.count("io < 709#7F") == 9


def test_a_bench_of_devices_that_a_test_has_made_replays(tmp_path: Path) -> None:
    rrc = Rrc(RrcConfig(device_name="OTHER"))
    with Bench(rrc=rrc, drive=make_epos(3), seed=1) as bench:
        bench.press("rrc/power_button", for_="100ms")
        bench.run_for("1s")
        assert replayed(bench, tmp_path / "run.trace").startswith("identical: ")


def test_a_device_rtc_of_a_file_replays_while_the_file_is_the_same(tmp_path: Path) -> None:
    file = tmp_path / "gripper.py"
    file.write_text((EXAMPLES / "device_rtc_gripper.py").read_text())
    device = DevicePlan(
        name="t", kind=DeviceKind.DEVICE_RTC, type=f"{file}:Gripper", wire="bus", node_id=9
    )
    with Bench.of_plan(plan_of(device, wires=(BUS,))) as bench:
        bench.run_for("100ms")
        assert replayed(bench, tmp_path / "run.trace", "--run-code").startswith("identical: ")
    for command in ("replay", "compare"):
        refused = CliRunner().invoke(main, [command, str(tmp_path / "run.trace")])
        assert refused.exit_code == 2
        assert refused.stderr == (
            f"Error: trace {tmp_path}/run.trace: device t: it names Python code,"
            f" {f'{file}:Gripper'!r:.80}; --run-code runs it\n"
        )
    file.write_text(file.read_text() + "# changed\n")
    result = CliRunner().invoke(main, ["replay", str(tmp_path / "run.trace"), "--run-code"])
    assert result.exit_code == 2
    assert result.stderr.endswith(
        f"device t: {file} is another file than the one that was recorded\n"
    )
