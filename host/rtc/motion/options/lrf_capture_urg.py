"""LRFCapture_URG, which converts scans of a range finder into range data."""

from __future__ import annotations

from math import tau
from typing import ClassVar

from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc import ExecutionContext, ModuleSpec, OutPort
from tickrig.host.rtc.device_component import DeviceComponent
from tickrig.host.rtc.motion.components.ref_hard import Opener
from tickrig.host.urg import UrgClient, UrgScan
from tickrig.wire.rtc_types.rtc import RangeData, RangerConfig, Time


class LrfCaptureUrg(DeviceComponent[UrgClient]):
    """Component that runs a URG laser scanner while Active, and writes each scan to a port.

    A range of 0 means that no distance was measured. The RH3 specification gives only the name of
    this component (LRFCapture_URG), so its ports and parameters are additions of Tickrig.

    Args:
        instance_name: name of the component.
        open_link: function that opens the line. By default, it is opened by pyserial.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("LRFCapture_URG", "Range data of a URG")

    def __init__(self, instance_name: str, open_link: Opener = SerialLink) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.device = bind("DeviceFileName", "/dev/ttyACM0")
        self.cluster = bind("cluster", 4, "1<=x<=99")
        self.ranges = self.add_port(OutPort("ranges", RangeData))
        self._open_link = open_link

    def open_client(self) -> UrgClient:
        """Open the line, and start the measurement."""
        return UrgClient(self._open_link(self.device.value), self.cluster.value)

    def exchange(self, ec: ExecutionContext, client: UrgClient) -> None:
        """Write the scans that have arrived."""
        for scan in client.poll():
            self.ranges.write(_range_data(Time.from_us(ec.now_us), scan))


def _range_data(now: Time, scan: UrgScan) -> RangeData:
    specification, numbers = scan.specification, scan.distances_mm
    low, high = specification.nearest_mm, specification.farthest_mm
    config = RangerConfig(
        minAngle=scan.angle_rad(0),
        maxAngle=scan.angle_rad(len(numbers) - 1),
        angularRes=scan.cluster * tau / specification.resolution,
        minRange=low / 1_000,
        maxRange=high / 1_000,
        rangeRes=0.001,
        frequency=specification.speed_rpm / 60,
    )
    ranges = tuple([n / 1_000 if low <= n <= high else 0.0 for n in numbers])
    return RangeData(now, ranges, config=config)
