# ruff: noqa: N815 - names as in the IDL, defaults are frozen
"""InterfaceDataTypes.idl of OpenRTM-aist 1.x: actuator arrays, grippers, limbs, pan-tilt units."""

from __future__ import annotations

from enum import IntEnum

from tickrig.wire.rtc_types.basic import Stamped
from tickrig.wire.rtc_types.extended_3d import OAP, Geometry3D, Orientation3D, Vector3D
from tickrig.wire.rtc_types.idl import Boolean, Double, Struct, UShort


class ActArrayActuatorPos(Stamped):
    """Position of an actuator, in m or rad."""

    index: UShort = 0
    position: Double = 0.0


class ActArrayActuatorSpeed(Stamped):
    """Speed of an actuator, in m/s or rad/s."""

    index: UShort = 0
    speed: Double = 0.0


class ActArrayActuatorCurrent(Stamped):
    """Current of an actuator, in A."""

    index: UShort = 0
    current: Double = 0.0


class ActArrayActuatorStatus(IntEnum):
    """What an actuator does."""

    ACTUATOR_STATUS_IDLE = 0
    ACTUATOR_STATUS_MOVING = 1
    ACTUATOR_STATUS_BRAKED = 2
    ACTUATOR_STATUS_STALLED = 3


class Actuator(Struct):
    """State of an actuator: m or rad, per s, per s^2, A."""

    position: Double = 0.0
    speed: Double = 0.0
    accel: Double = 0.0
    current: Double = 0.0
    status: ActArrayActuatorStatus = ActArrayActuatorStatus.ACTUATOR_STATUS_IDLE


class ActArrayState(Stamped):
    """State of all actuators of an array."""

    actuators: tuple[Actuator, ...] = ()


class ActArrayActuatorType(IntEnum):
    """How an actuator moves."""

    ACTARRAY_ACTUATORTYPE_LINEAR = 0
    ACTARRAY_ACTUATORTYPE_ROTARY = 1


class ActArrayActuatorGeometry(Struct):
    """Geometry of an actuator and the link to the next one."""

    type: ActArrayActuatorType = ActArrayActuatorType.ACTARRAY_ACTUATORTYPE_LINEAR
    length: Double = 0.0
    orientation: Orientation3D = Orientation3D()
    axis: Vector3D = Vector3D()
    minRange: Double = 0.0
    centre: Double = 0.0
    maxRange: Double = 0.0
    homePosition: Double = 0.0
    hasBrakes: Boolean = False


class ActArrayGeometry(Struct):
    """Geometry of an array of actuators."""

    arrayGeometry: Geometry3D = Geometry3D()
    actuatorGeometry: tuple[ActArrayActuatorGeometry, ...] = ()


class GripperStatus(IntEnum):
    """What a gripper does."""

    GRIPPER_STATE_OPEN = 0
    GRIPPER_STATE_CLOSED = 1
    GRIPPER_STATE_MOVING = 2
    GRIPPER_STATE_UNKNOWN = 3


class GripperState(Stamped):
    """State of a gripper."""

    status: GripperStatus = GripperStatus.GRIPPER_STATE_OPEN


class GripperGeometry(Struct):
    """Geometry of an open gripper."""

    exterior: Geometry3D = Geometry3D()
    interior: Geometry3D = Geometry3D()


class LimbStatus(IntEnum):
    """What a limb does."""

    LIMB_STATUS_IDLE = 0
    LIMB_STATUS_BRAKED = 1
    LIMB_STATUS_MOVING = 2
    LIMB_STATUS_OOR = 3
    LIMB_STATUS_COLLISION = 4


class LimbState(Stamped):
    """State of a limb and its end effector."""

    oapMatrix: OAP = OAP()
    status: LimbStatus = LimbStatus.LIMB_STATUS_IDLE


class PanTiltAngles(Stamped):
    """Angles of a pan-tilt unit, in rad."""

    pan: Double = 0.0
    tilt: Double = 0.0


class PanTiltState(Stamped):
    """Angles and speeds of a pan-tilt unit, in rad and rad/s."""

    angles: PanTiltAngles = PanTiltAngles()
    panSpeed: Double = 0.0
    tiltSpeed: Double = 0.0
