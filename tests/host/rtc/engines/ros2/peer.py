# mypy: ignore-errors
"""A peer: Cyclone DDS and types of its own, nothing of ours. Commands on stdin, JSON on stdout.

read TOPIC TYPE           what comes is printed, a line each
write TOPIC TYPE NUMBER...
offer TOPIC TYPE          be a writer that writes nothing
best_effort               of what is made from now on
policy EXPRESSION         likewise: Deadline(1_000_000)
"""

import json
import select
import sys
from dataclasses import asdict, dataclass
from typing import Any

from cyclonedds.core import Policy, Qos
from cyclonedds.domain import Domain, DomainParticipant
from cyclonedds.idl import IdlStruct
from cyclonedds.idl.types import array, float32, float64, int32, sequence, uint8, uint32
from cyclonedds.internal import InvalidSample
from cyclonedds.pub import DataWriter
from cyclonedds.sub import DataReader
from cyclonedds.topic import Topic

CONFIGURATION = """<CycloneDDS><Domain><General><Interfaces>
<NetworkInterface address="127.0.0.1" multicast="false"/></Interfaces></General>
<Discovery><ParticipantIndex>auto</ParticipantIndex><Peers><Peer Address="127.0.0.1"/></Peers>
</Discovery>{more}</Domain></CycloneDDS>"""
CARELESS = "<Compatibility><IgnoreTypeInformation>1.16</IgnoreTypeInformation></Compatibility>"
"""As Fast DDS: looks at the names of types alone. 1.16 is Cyclone DDS."""


@dataclass
class Stamp(IdlStruct, typename="builtin_interfaces.msg.dds_.Time_"):
    sec: int32
    nanosec: uint32


@dataclass
class Header(IdlStruct, typename="std_msgs.msg.dds_.Header_"):
    stamp: Stamp
    frame_id: str


@dataclass
class Vector3(IdlStruct, typename="geometry_msgs.msg.dds_.Vector3_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Point(IdlStruct, typename="geometry_msgs.msg.dds_.Point_"):
    x: float64
    y: float64
    z: float64


@dataclass
class Quaternion(IdlStruct, typename="geometry_msgs.msg.dds_.Quaternion_"):
    x: float64
    y: float64
    z: float64
    w: float64


@dataclass
class Twist(IdlStruct, typename="geometry_msgs.msg.dds_.Twist_"):
    linear: Vector3
    angular: Vector3


@dataclass
class Pose(IdlStruct, typename="geometry_msgs.msg.dds_.Pose_"):
    position: Point
    orientation: Quaternion


@dataclass
class PoseWithCovariance(IdlStruct, typename="geometry_msgs.msg.dds_.PoseWithCovariance_"):
    pose: Pose
    covariance: array[float64, 36]


@dataclass
class TwistWithCovariance(IdlStruct, typename="geometry_msgs.msg.dds_.TwistWithCovariance_"):
    twist: Twist
    covariance: array[float64, 36]


@dataclass
class Odometry(IdlStruct, typename="nav_msgs.msg.dds_.Odometry_"):
    header: Header
    child_frame_id: str
    pose: PoseWithCovariance
    twist: TwistWithCovariance


@dataclass
class Transform(IdlStruct, typename="geometry_msgs.msg.dds_.Transform_"):
    translation: Vector3
    rotation: Quaternion


@dataclass
class TransformStamped(IdlStruct, typename="geometry_msgs.msg.dds_.TransformStamped_"):
    header: Header
    child_frame_id: str
    transform: Transform


@dataclass
class TFMessage(IdlStruct, typename="tf2_msgs.msg.dds_.TFMessage_"):
    transforms: sequence[TransformStamped]


@dataclass
class JointState(IdlStruct, typename="sensor_msgs.msg.dds_.JointState_"):
    header: Header
    name: sequence[str]
    position: sequence[float64]
    velocity: sequence[float64]
    effort: sequence[float64]


@dataclass
class LaserScan(IdlStruct, typename="sensor_msgs.msg.dds_.LaserScan_"):
    header: Header
    angle_min: float32
    angle_max: float32
    angle_increment: float32
    time_increment: float32
    scan_time: float32
    range_min: float32
    range_max: float32
    ranges: sequence[float32]
    intensities: sequence[float32]


@dataclass
class KeyValue(IdlStruct, typename="diagnostic_msgs.msg.dds_.KeyValue_"):
    key: str
    value: str


@dataclass
class DiagnosticStatus(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticStatus_"):
    level: uint8
    name: str
    message: str
    hardware_id: str
    values: sequence[KeyValue]


@dataclass
class DiagnosticArray(IdlStruct, typename="diagnostic_msgs.msg.dds_.DiagnosticArray_"):
    header: Header
    status: sequence[DiagnosticStatus]


@dataclass
class Int32(IdlStruct, typename="std_msgs.msg.dds_.Int32_"):
    data: int32


@dataclass
class WrongTwist(IdlStruct, typename="geometry_msgs.msg.dds_.Twist_"):
    """What calls itself a Twist, and is none."""

    linear: str


class Peer:
    def __init__(self, domain: int, more: str) -> None:
        self.domain: Any = Domain(domain, CONFIGURATION.format(more=more))
        self.participant = DomainParticipant(domain)
        self.readers: dict[str, Any] = {}
        self.writers: dict[str, Any] = {}
        self.reliability: Any = Policy.Reliability.Reliable(100_000_000)
        self.policies: list[Any] = []

    def run(self) -> None:
        print(json.dumps({"ready": True}), flush=True)
        commands = open(0, "rb", buffering=0)  # noqa: SIM115 - of this process; select sees each line
        while True:
            if select.select([commands], [], [], 0.002)[0]:
                if not (line := commands.readline()):
                    return
                self.obey(line.decode().split())
            for topic, reader in self.readers.items():
                for found in reader.take(100):
                    if not isinstance(found, InvalidSample):
                        print(json.dumps({"topic": topic, "message": asdict(found)}), flush=True)

    def obey(self, words: list[str]) -> None:
        match words:
            case ["read", topic, kind]:
                self.readers[topic] = DataReader(self.participant, *self.topic(topic, kind))
            case ["offer", topic, kind]:
                self.writer(topic, kind)
            case ["write", topic, kind, *numbers]:
                self.writer(topic, kind).write(made(kind, numbers))
            case ["best_effort"]:
                self.reliability = Policy.Reliability.BestEffort
            case ["policy", expression]:
                self.policies = [eval(f"Policy.{expression}")]
            case _:
                raise ValueError(words)

    def topic(self, name: str, kind: str) -> tuple[Any, Qos]:
        qos = Qos(
            self.reliability,
            Policy.History.KeepLast(10),
            Policy.DataRepresentation(use_cdrv0_representation=True),
            *self.policies,
        )
        return Topic(self.participant, f"rt/{name}", globals()[kind]), qos

    def writer(self, topic: str, kind: str) -> Any:
        if topic not in self.writers:
            self.writers[topic] = DataWriter(self.participant, *self.topic(topic, kind))
        return self.writers[topic]


def made(kind: str, words: list[str]) -> Any:
    match kind:
        case "Int32":
            return Int32(int(words[0]))
        case "Twist":
            numbers = [float(word) for word in words]
            return Twist(Vector3(*numbers[:3]), Vector3(*numbers[3:]))
        case "WrongTwist":
            return WrongTwist(words[0])
    raise ValueError(kind)


if __name__ == "__main__":
    Peer(int(sys.argv[-1]), CARELESS if "careless" in sys.argv else "").run()
