from __future__ import annotations

from pathlib import Path

import pytest

from tickrig.device.canopen.slave import UNCONFIGURED
from tickrig.emulators.canopen.rig_file import read_rig
from tickrig.emulators.testing.rig_file.plan import DeviceKind, RigPlan
from tickrig.emulators.testing.rig_file.reader import parse_rig_file, read_rig_file
from tickrig.emulators.testing.rig_file.schema import RigFileError

RIGS = Path(__file__).parents[4] / "examples" / "rigs"


def read(text: str, path: Path = Path("rig.toml")) -> RigPlan:
    return parse_rig_file(text, path)


@pytest.mark.parametrize("name", ["beego", "fig120", "followers", "fourx"])
def test_a_canopen_rig_is_a_bench_of_its_nodes(name: str) -> None:
    file = RIGS / f"{name}.toml"
    old, plan = read_rig(file), read_rig_file(file)
    assert [(each.type, each.node_id) for each in plan.devices.values()] == [
        (node.device, node.node_id) for node in old.nodes
    ]
    assert list(plan.devices) == [str(node.node_id) for node in old.nodes]
    assert {each.wire for each in plan.devices.values()} == {"can"}
    if old.body is None:
        assert plan.body is None
    else:
        assert plan.body is not None
        drives = {wheel: str(node_id) for wheel, node_id in old.body.drives.items()}
        assert (plan.body.kind, plan.body.drives) == (old.body.parameters.kind, drives)


def test_nodes_of_files_and_nodes_that_wait_are_read() -> None:
    eds = (RIGS / ".." / "io_module.eds").resolve()
    plan = read(
        f'[[node]]\nid = "lss"\neds = "{eds}"\nprofile = "401"\n'
        f'[[node]]\nid = "lss"\neds = "{eds}"\n[[node]]\nmodel = "epos"\n'
    )
    assert [(each.name, each.kind, each.node_id) for each in plan.devices.values()] == [
        ("lss", DeviceKind.EDS, UNCONFIGURED),
        ("lss2", DeviceKind.EDS, UNCONFIGURED),
        ("1", DeviceKind.MODEL, None),
    ]
    assert plan.devices["lss"].profile == "401"


def test_where_a_real_rrc_is_is_hardware(tmp_path: Path) -> None:
    file = tmp_path / "rig.toml"
    file.write_text(
        '[dut.rrc]\nport = "/dev/ttyACM0"\n[tolerance]\nstick_pct = 5\ntime_ms = 20\n'
        f'[operator]\ncontrol = "{tmp_path}/rrc.ctl"\n'
    )
    plan = read_rig_file(file)
    assert [each.type for each in plan.devices.values()] == ["rrc"]
    assert plan.hardware is not None
    assert plan.hardware.ports["rrc"].port == "/dev/ttyACM0"
    assert plan.hardware.control["rrc"] == tmp_path / "rrc.ctl"
    tolerance = plan.hardware.tolerance
    assert (tolerance.stick_pct, tolerance.time_us) == (5, 20_000)


@pytest.mark.parametrize(
    ("text", "mistakes"),
    [
        ('[[node]]\nid = 500\nmodel = "epos"', ["2: node[1].id: id 500: a node-ID is 1..127"]),
        ('[[node]]\nid = 5\nmodl = "epos"', ["3: node[1]: no key 'modl'; did you mean 'model'?"]),
        ("[[node]]\nid = 5", ["1: node[1]: it has one of eds, model, rtc"]),
        ('[[node]]\nid = 5\nmodel = "eops"', ["3: node[1].model: no device 'eops'; did you"]),
        ('[[node]]\nid = "5-9"\neds = "a.eds"', ["3: node[1].eds: file a.eds: No such file"]),
        (
            '[[node]]\nid = "5-6"\nmodel = "epos"\n[[node]]\nid = 6\nmodel = "epos"',
            ["5: node[2].id: node 6 is there twice"],
        ),
        ("node = []", ["1: no device: a rig file has tables"]),
        ("node = [5]", ["1: node[1]: it is a table [[node]], not 5"]),
        ('[[node]]\nid = 5\nmodel = "epos"\n[bdy]', ["4: no key 'bdy'; did you mean 'body'?"]),
        (
            '[[node]]\nid = 5\nmodel = "epos"\n[body]\nkind = "differential"\nleft = 5\n'
            "right = 6\nwheel_radius_m = 1\ntread_m = 1",
            ["7: body.right: no device '6'; known: 5"],
        ),
        ("[dut.rrc]\nprt = 'x'", ["2: dut.rrc: no key 'prt'; did you mean 'port'?"]),
        ("[dut.rrc]", ["1: dut.rrc: no key 'port': where it is"]),
        ("[dut.rcr]\nport = 'x'", ["1: dut: no key 'rcr'; did you mean 'rrc'?"]),
        (
            "[dut.rrc]\nport = 'x'\n[tolerance]\nstick_pct = 51\n[operatr]",
            ["4: tolerance.stick_pct: it takes a number 0..50", "5: no key 'operatr'; did you"],
        ),
        ('[[component]]\nname = "a"', ["1: component: it is a system of RT components"]),
        ("# drive\n\n0.1s press power_button\n", ["1: it is a scenario: --scenario FILE plays"]),
        ("+10ms send hello", ["1: it is a scenario"]),
    ],
)
def test_a_mistake_is_told_in_the_words_of_its_file(text: str, mistakes: list[str]) -> None:
    with pytest.raises(RigFileError) as caught:
        read(text)
    found = [f"{line}: {reason}" for line, reason in caught.value.mistakes]
    assert len(found) == len(mistakes), found
    assert all(map(str.startswith, found, mistakes)), found
