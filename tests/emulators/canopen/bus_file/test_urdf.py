"""Joints of a URDF: what is read of them, what is wrong with a file, and what a drive has of it."""

from __future__ import annotations

from contextlib import suppress
from math import degrees
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.emulators.canopen.bus_file.system import ONE_JOINT, joints, write_system
from tests.soak import examples
from tickrig import open_bench
from tickrig.emulators.canopen.bus_file.bus_nodes import read_bus
from tickrig.emulators.canopen.bus_file.node_keys import BusMistakesError
from tickrig.emulators.canopen.bus_file.urdf import UrdfJoint, parse_urdf

ARM = """\
<?xml version="1.0"?>
<robot name="arm">
  <link name="base"/>
  <joint name="shoulder" type="revolute">
    <limit lower="-1.5" upper="0.5" effort="20" velocity="2"/>
  </joint>
  <joint name="wrist" type="continuous"><limit effort="3" velocity="0"/></joint>
  <joint name="slide" type="prismatic">
    <limit lower="0" upper="0.4" effort="200" velocity="0.1"/>
  </joint>
  <joint name="fixed" type="fixed"/>
  <transmission name="t1">
    <joint name="shoulder"/>
    <actuator name="m1"><mechanicalReduction>-80</mechanicalReduction></actuator>
  </transmission>
  <ros2_control name="bus" type="system">
    <joint name="shoulder"><param name="device_name">joint_1</param></joint>
    <joint name="wrist"><param name="node_id"> 3 </param></joint>
    <joint name="slide"><param name="device_name">joint_3</param></joint>
    <joint name="gripper"><command_interface name="position"/></joint>
    <transmission name="t2">
      <joint name="wrist" role="wrist"><mechanical_reduction>30</mechanical_reduction></joint>
    </transmission>
  </ros2_control>
</robot>
"""


def read(text: str) -> tuple[UrdfJoint, ...]:
    return parse_urdf(text.encode(), "arm.urdf").joints


def mistakes(text: str) -> str:
    with pytest.raises(BusMistakesError) as told:
        read(text)
    return str(told.value)


def test_joints_that_have_a_device_are_read_with_limits_and_reduction() -> None:
    shoulder, wrist, slide = read(ARM)
    assert (shoulder.device_name, shoulder.node_id, shoulder.kind) == ("joint_1", None, "revolute")
    assert (shoulder.lower, shoulder.upper, shoulder.effort) == (-1.5, 0.5, 20.0)
    assert (shoulder.velocity, shoulder.reduction) == (2.0, 80.0)
    assert (wrist.node_id, wrist.lower, wrist.velocity, wrist.effort) == (3, None, None, 3.0)
    assert (wrist.reduction, slide.kind, slide.upper) == (30.0, "prismatic", 0.4)
    assert shoulder.place == ("arm.urdf", 17)


@pytest.mark.parametrize(
    ("old", "new", "error"),
    [
        ('lower="-1.5"', 'lower="${-pi}"', "5: joint 'shoulder': limit lower: '${-pi}' is no"),
        ('lower="-1.5"', 'lower="2"', "4: joint 'shoulder': limit lower 2 is above upper 0.5"),
        ('effort="20"', 'effort="-20"', "4: joint 'shoulder': limit effort -20 is below 0"),
        ('effort="20"', 'effort="nan"', "5: joint 'shoulder': limit effort: 'nan' is no number"),
        ("-80", "0", "14: shoulder: 0 is no reduction"),
        ("-80", "$(arg r)", "14: shoulder: '$(arg r)' is no number: xacro a.urdf.xacro > a.urdf"),
        (" 3 ", "300", "18: node_id '300' is not 1..127"),
        ('"slide" type', '"slid" type', "19: joint 'slide': the robot has no joint of this name"),
        ('"prismatic"', '"planar"', "8: joint 'slide': type 'planar' is not one of revolute"),
        ('<link name="base"/>', '<xacro:include filename="a"/>', "3: <xacro:include> is not exp"),
        ("robot", "model", "2: <model> is no <robot>"),
        ("</robot>", "", "is no XML: no element found"),
    ],
)
def test_what_is_wrong_is_told_with_its_line(old: str, new: str, error: str) -> None:
    assert error in mistakes(ARM.replace(old, new))


def test_all_mistakes_are_told_at_once() -> None:
    text = ARM.replace("-80", "x").replace('effort="20"', 'effort="y"').replace(" 3 ", "z")
    assert [line.split(":")[1] for line in mistakes(text).splitlines()] == ["5", "14", "18"]


def test_a_document_type_is_refused_and_nothing_expands() -> None:
    laughs = '<!DOCTYPE robot [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><robot>&b;</robot>'
    assert "has a document type, which is refused" in mistakes(laughs)


def test_a_file_that_is_too_large_is_none() -> None:
    with pytest.raises(BusMistakesError, match="no URDF"):
        parse_urdf(b" " * 32_000_001, "arm.urdf")


@given(st.data())
@settings(max_examples=examples(60))
def test_a_damaged_file_is_read_or_told_to_be_wrong(data: st.DataObject) -> None:
    noise = data.draw(st.text(max_size=6))
    begin, end = sorted(data.draw(st.tuples(*[st.integers(0, len(ARM))] * 2)))
    end = min(end, begin + data.draw(st.integers(0, 30)))
    with suppress(BusMistakesError):
        read(ARM[:begin] + noise + ARM[end:])


@given(st.binary(max_size=60))
@settings(max_examples=examples(60))
def test_noise_is_no_urdf(data: bytes) -> None:
    with pytest.raises(BusMistakesError):
        parse_urdf(data, "arm.urdf")


BUS = f"""\
options:
  tickrig: {{urdf: arm.urdf}}
{ONE_JOINT}
wrist:
  node_id: 3
  dcf: joint.eds
  tickrig: {{velocity: 9}}
joint_3:
  node_id: 4
  dcf: joint.eds
"""


def test_a_joint_of_a_bus_has_what_its_robot_says(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    path = write_system(tmp_path, BUS)
    with joints(path, 2) as (bench, [joint]):
        one = bench["joint_1"]
        assert one.get("positive_limit_at") == pytest.approx(degrees(0.51))
        assert bench["wrist"].get("positive_limit_at") == 1e9
        assert bench["joint_3"].get("positive_limit_at") == pytest.approx(0.401 / 0.01 * 360)
        joint.enable(3)
        joint.write(0x60FF, 9_000, 4)
        bench.run_for("230ms")
        assert one.get("shaft_deg_s") == pytest.approx(degrees(2.0), rel=0.02)
        bench.run_for("1s")
        assert one.get("shaft_deg") == pytest.approx(degrees(0.5), abs=10)
        assert joint.read(0x60FD) == 2


def test_the_motor_is_as_strong_as_the_robot_says(tmp_path: Path) -> None:
    """Effort 20 Nm: 15 Nm do not stop it, 40 Nm do."""
    (tmp_path / "arm.urdf").write_text(ARM)
    stands = []
    for load_nm in (-15.0, -40.0):
        with joints(write_system(tmp_path, BUS), 2) as (bench, [joint]):
            joint.enable(3)
            bench["joint_1"].set("load_nm", load_nm)
            joint.write(0x60FF, 500, 4)
            bench.run_for("400ms")
            stands.append(float(bench["joint_1"].get("shaft_deg_s")) < 1)
    assert stands == [False, True]


def test_a_joint_without_node_is_told(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM)
    path = write_system(tmp_path, BUS.replace("joint_3", "joint_4"))
    remarks = read_bus(path).remarks
    assert f"{tmp_path / 'arm.urdf'}:19: joint 'slide': no node 'joint_3' in bus.yml" in remarks


def test_a_robot_that_changed_is_read_again(tmp_path: Path) -> None:
    robot = tmp_path / "arm.urdf"
    path = write_system(tmp_path, BUS)
    for upper in (0.5, 0.25):
        robot.write_text(ARM.replace('upper="0.5"', f'upper="{upper}"'))
        with open_bench(path) as bench:
            assert bench["joint_1"].get("positive_limit_at") == pytest.approx(degrees(upper + 0.01))


def test_a_joint_at_its_limit_presses_no_switch(tmp_path: Path) -> None:
    (tmp_path / "arm.urdf").write_text(ARM.replace('lower="-1.5"', 'lower="0"'))
    with joints(write_system(tmp_path, BUS), 2) as (bench, [joint]):
        joint.enable(1)
        for target in (500, 0):
            joint.write(0x607A, target, 4)
            joint.write(0x6040, 0x0F, 2)
            joint.write(0x6040, 0x1F, 2)
            bench.run_for("2s")
            assert joint.read(0x6064, signed=True) == pytest.approx(target, abs=1)
            assert joint.read(0x60FD) == 0
        bench["joint_1"].set("load_nm", -200.0)
        bench.run_for("1s")
        assert joint.read(0x60FD) == 1
