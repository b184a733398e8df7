"""What can be copied is copied whole; what cannot says so, whoever copies."""

from __future__ import annotations

import copy
import importlib
import pickle
import pkgutil
from collections.abc import Callable, Iterator
from typing import Final

import pytest

import tickrig.device
from tests.device.canopen.profile_objects import DRIVE, make_dictionary
from tickrig.device.body import BodyParameters, OmniBody, OmniParameters, Pose, WheeledBody
from tickrig.device.canopen.device_rtc import CanopenEcho, make_device_rtc
from tickrig.device.canopen.ds402.drive import Ds402
from tickrig.device.canopen.models import epos, f_palette, f_palette_boot, motor_core_unit
from tickrig.device.canopen.slave import Application, CanopenSlave, Service
from tickrig.device.canopen.stack import make_slave
from tickrig.device.modbus import ModbusSlave
from tickrig.device.physical import InputSignal, OutputSignal
from tickrig.device.rh3.base import Rh3Base
from tickrig.device.rh3.parameters import BaseParameters
from tickrig.device.rrc.machine import Rrc
from tickrig.device.rrc.settings import RrcConfig
from tickrig.device.rtc_lite.component import LiteComponent
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.device.rtc_lite.server import LiteConfig
from tickrig.device.servo.parameters import EPOS_WHEEL
from tickrig.device.servo.servo import Servo
from tickrig.device.twin import Copyable, NonCopyable
from tickrig.device.ucode_reader import Marker, ReaderParameters, UcodeReader
from tickrig.device.urg.sensor import Urg
from tickrig.device.urg.world import Post, UrgParameters, World, room
from tickrig.wire.can import CanFrame

WHEELS: Final = BodyParameters(kind="differential", wheel_radius_m=0.1, tread_m=0.4)


class Blink(LiteComponent):
    type_name = "Blink"


def lite_node() -> RtcLiteNode:
    node = RtcLiteNode(Blink)
    node.tick(1_000, b"")
    return node


def slave() -> CanopenSlave:
    return make_slave(make_dictionary(()), 5)


MACHINES: Final[dict[str, Callable[[], object]]] = {
    "RRC": Rrc,
    "RTC-Lite node": lite_node,
    "its component": lambda: lite_node().component,
    "RH3 base": Rh3Base,
    "Modbus slave": lambda: Rh3Base().slave,
    "URG": Urg,
    "ucode reader": UcodeReader,
    "servo": lambda: Servo(EPOS_WHEEL),
    "wheeled body": lambda: WheeledBody(WHEELS),
    "omni body": OmniBody,
    "CANopen slave": slave,
    "CiA 402 drive": lambda: make_slave(make_dictionary({DRIVE}), 5, application=Ds402),
    "EPOS": lambda: epos.make_epos(5),
    "f-palette": lambda: f_palette.make_f_palette(5),
    "f-palette-boot": lambda: f_palette_boot.make_f_palette_boot(5),
    "motor core unit": lambda: motor_core_unit.make_motor_core_unit(5),
    "DeviceRTC": lambda: make_device_rtc(CanopenEcho, 5),
    "application": lambda: Application.of(slave()),
}

WAYS: Final[dict[str, Callable[[object], object]]] = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "deepcopy within": lambda device: copy.deepcopy({"rig": [device]}),
    **{
        f"pickle {protocol}": lambda device, protocol=protocol: pickle.dumps(device, protocol)  # type: ignore[misc]
        for protocol in range(pickle.HIGHEST_PROTOCOL + 1)
    },
}


class Socket(NonCopyable):
    """Belongs to its process."""


def test_what_cannot_be_copied_says_so() -> None:
    device = Socket()
    for way, copied in WAYS.items():
        with pytest.raises(TypeError) as caught:
            copied(device)
        text = str(caught.value)
        assert "cannot be copied" in text, way
        assert "\n" not in text, way


@pytest.mark.unmeasured
@pytest.mark.parametrize("make", MACHINES.values(), ids=MACHINES)
def test_a_copy_is_another_machine(make: Callable[[], object]) -> None:
    machine = make()
    for copied in (copy.deepcopy(machine), pickle.loads(pickle.dumps(machine))):
        assert type(copied) is type(machine)
        assert copied is not machine


@pytest.mark.parametrize("make", MACHINES.values(), ids=MACHINES)
def test_a_shallow_copy_is_refused(make: Callable[[], object]) -> None:
    with pytest.raises(TypeError, match=r"cannot be copied by copy\.copy: use copy\.deepcopy"):
        copy.copy(make())


def classes() -> Iterator[type]:
    """Give every class of device/."""
    package = tickrig.device
    for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
        for value in vars(importlib.import_module(module.name)).values():
            if isinstance(value, type) and value.__module__ == module.name:
                yield value


def is_machine(kind: type) -> bool:
    is_device = all(hasattr(kind, name) for name in ("tick", "reset"))
    is_body = kind.__module__.endswith(".body") and hasattr(kind, "step")
    return is_device or is_body or issubclass(kind, Service)


def test_every_type_of_machine_is_copied_or_refuses() -> None:
    machines = {
        kind for kind in classes() if is_machine(kind) and not getattr(kind, "_is_protocol", False)
    }
    assert {Rrc, Urg, CanopenSlave, WheeledBody, OmniBody, ModbusSlave} <= machines
    assert [kind for kind in machines if not issubclass(kind, (Copyable, NonCopyable))] == []


FROZEN: Final = (
    *(RrcConfig(), LiteConfig(), UrgParameters(), BaseParameters(), WHEELS, OmniParameters()),
    *(World(posts=(Post(1, 0, 0.2),)), room(4, 3), Pose(1, 2, 3), EPOS_WHEEL),
    *(ReaderParameters(), Marker("0" * 32, 1, 2)),
    *(InputSignal("lamp", "lamp"), OutputSignal("state", "state"), CanFrame.parse("123#00")),
)


@pytest.mark.parametrize("value", FROZEN, ids=lambda value: type(value).__name__)
def test_values_are_copied(value: object) -> None:
    assert copy.copy(value) == copy.deepcopy(value) == pickle.loads(pickle.dumps(value)) == value


def test_a_servo_goes_on_in_its_copy_and_leaves_it_alone() -> None:
    servo, alone = Servo(EPOS_WHEEL), Servo(EPOS_WHEEL)
    for each in (servo, alone):
        each.drive_velocity(5_000.0)
        each.step_to(40_000)
    twin, other = copy.deepcopy(servo), pickle.loads(pickle.dumps(servo))
    other.drive_current(-3.0)
    for each in (other, twin, servo, alone):
        each.step_to(1_000_000)
    assert twin.counts == servo.counts == alone.counts != other.counts
