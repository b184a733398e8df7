"""Ports and configuration of all six components (RH3 functional specification)."""

from __future__ import annotations

import pytest

from tickrig.host.rtc import Manager, RtComponent
from tickrig.host.rtc.motion.chain import MotionChain
from tickrig.host.rtc.ports.data_port import DataPort
from tickrig.host.rtc.ports.service_port import ServicePort

PORTS = """
PositionInput > position IIS/TimedPose2D
PositionInput < status RTC/TimedState
OmniTo2WD < current_position IIS/TimedPose2D
OmniTo2WD < goal IIS/TimedPose2D
OmniTo2WD < status RTC/TimedState
OmniTo2WD > min_path IIS/TimedPath2DSeq
OmniTo2WD > status_out RTC/TimedState
Navigation < position IIS/TimedPose2D
Navigation < min_path IIS/TimedPath2DSeq
Navigation > path RTC/Path
Navigation > status RTC/TimedState
PathFollower < position IIS/TimedPose2D
PathFollower < target_path RTC/Path
PathFollower > velocity IIS/TimedVelocity2D
RefHardRh3 < InTargetVelocity IIS/TimedVelocity2D
RefHardRh3 > OutWheelAngle RTC/TimedDoubleSeq
RefHardRh3 = InventGUIRefHard service:RefHard
RefHardRh3 = BumpRefHard service:RefHard
Odometry < CurrentWheelAngle RTC/TimedDoubleSeq
Odometry < LocalizedPosition IIS/TimedPose2D
Odometry > OdometryPosition IIS/TimedPose2D
"""
"""< in, > out, = service. The specification calls both `status` ports of OmniTo2WD so."""

CONFIGURATION = {
    "PositionInput": "01_x 3.4 01_y 7.7 01_th -1.57",
    "OmniTo2WD": "",
    "Navigation": "judge_radius 0.5 max_vel 0.3",
    "PathFollower": (
        "control_cycle 0.02 line_C1 0.01 line_Dist 0.05 line_K1 800.0 line_K2 300.0 "
        "line_K3 400.0 max_acc_v 0.0003 max_acc_w 0.1 max_v 1.0 max_w 0.3"
    ),
    "RefHardRh3": (
        "DeviceFileName /dev/ttyUSB0 gain_P 10 gain_I 0 gain_D 0 gain_VP 10 gain_VI 0 gain_VD 1 "
        "Velocity_limit 10.0 Acceleration_limit 50.0 WheelTread 0.441 WheelRadiusLeft 0.1 "
        "WheelRadiusRight 0.1 GearRatio 74.91 EncoderCount 2000 EncoderConstant_L 1.0 "
        "EncoderConstant_R 1.0"
    ),
    "Odometry": (
        "leftWheelID 0 rightWheelID 1 radiusOfLeftWheel 0.0995 radiusOfRightWheel 0.0995 "
        "lengthOfAxle 0.464 radiusOfBodyArea 0.45 initialPose_x 0.0 initialPose_y 0.0 "
        "initialPose_theta 0.0"
    ),
}

OURS = {
    "Navigation": "align_angle turn_angle goal_angle goal_distance creep_vel braking latency",
    "PathFollower": "acc_cycle law spin latency pose_timeout tread radius",
    "RefHardRh3": "AnyDevice",
}


@pytest.fixture(scope="module")
def components() -> dict[str, RtComponent]:
    chain = MotionChain(Manager())
    return {component.spec.type_name: component for component in chain.components}


def test_the_ports_are_those_of_the_specification(components: dict[str, RtComponent]) -> None:
    lines = [
        line
        for name, component in components.items()
        for port in component.ports.values()
        for line in described(name, port)
    ]
    assert sorted(lines) == sorted(PORTS.split("\n")[1:-1])


def described(name: str, port: object) -> list[str]:
    """Return a port as `PORTS` has it."""
    if isinstance(port, ServicePort):
        profiles = (provider.profile for provider in port.providers)
        return [f"{name} = {port.name} {p.instance_name}:{p.type_name}" for p in profiles]
    assert isinstance(port, DataPort)
    way = "<" if port.port_type == "DataInPort" else ">"
    kind = port.data_type.idl_id().removeprefix("IDL:").removesuffix(":1.0")
    return [f"{name} {way} {port.name} {kind}"]


@pytest.mark.parametrize("name", CONFIGURATION)
def test_names_and_defaults_are_those_of_the_specification(
    name: str, components: dict[str, RtComponent]
) -> None:
    parameters = components[name].configuration.parameters
    words = CONFIGURATION[name].split()
    wanted = dict(zip(words[::2], words[1::2], strict=True))
    assert {key: parameters[key].text for key in wanted} == wanted
    assert set(parameters) - set(wanted) == set(OURS.get(name, "").split())


def test_there_are_a_faithful_and_a_tuned_set(components: dict[str, RtComponent]) -> None:
    sets = {name: tuple(c.configuration.sets) for name, c in components.items()}
    assert {name for name, ids in sets.items() if ids == ("default", "tuned")} == {
        "Navigation",
        "PathFollower",
    }
    tuned = components["PathFollower"].configuration.sets["tuned"]
    assert (tuned["line_K3"], tuned["spin"]) == ("40", "time-optimal")


def test_the_first_cart_has_the_names_of_the_specification_the_second_the_next_number() -> None:
    manager = Manager()
    first, second = MotionChain(manager), MotionChain(manager, number=1)
    assert [component.instance_name for component in first.components] == [
        *("RefHardRh30", "Odometry0", "PositionInput0"),
        *("OmniTo2WD0", "Navigation0", "PathFollower0"),
    ]
    assert manager.find("Navigation0") is first.navigation
    assert manager.find("Navigation1") is second.navigation
