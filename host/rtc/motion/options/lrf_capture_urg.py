"""LRFCapture_URG: scans of a range finder become range data."""

from __future__ import annotations

from math import tau
from typing import ClassVar, Final

from tickrig.host.links.link import DeviceRefused, LinkError
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc import ExecutionContext, ModuleSpec, OutPort, ReturnCode, RtComponent
from tickrig.host.rtc.motion.components.ref_hard import Opener
from tickrig.host.text.log import log_of
from tickrig.host.urg import UrgClient, UrgScan
from tickrig.wire.rtc_types.rtc import RangeData, RangerConfig, Time

_LOG: Final = log_of(__name__)


class LrfCaptureUrg(RtComponent):
    """Lets a sensor measure while it is Active, and writes each scan.

    A range of 0 means that there was no distance. The specification only names it
    (LRFCapture_URG); ports and parameters are ours.

    Args:
        instance_name: of the component.
        open_link: opens the line; by pyserial unless given.
    """

    spec: ClassVar[ModuleSpec] = ModuleSpec("LRFCapture_URG", "Range data of a URG")

    def __init__(self, instance_name: str, open_link: Opener = SerialLink) -> None:
        super().__init__(instance_name)
        bind = self.configuration.bind
        self.device = bind("DeviceFileName", "/dev/ttyACM0")
        self.cluster = bind("cluster", 4, "1<=x<=99")
        self.ranges = self.add_port(OutPort("ranges", RangeData))
        self._open_link = open_link
        self._client: UrgClient | None = None

    def on_activated(self, ec: ExecutionContext) -> ReturnCode:
        """Open the line, and let the sensor measure; also after Error."""
        try:
            link = self._open_link(self.device.value)
            self._client = UrgClient(link, self.cluster.value)
        except LinkError as error:
            return self._failed(error)
        return ReturnCode.RTC_OK

    def on_deactivated(self, ec: ExecutionContext) -> ReturnCode:
        """Switch the laser off, and give the line back."""
        self._close()
        return ReturnCode.RTC_OK

    def on_execute(self, ec: ExecutionContext) -> ReturnCode:
        """Write the scans that have come."""
        if self._client is None:
            return ReturnCode.RTC_ERROR
        try:
            scans = self._client.poll()
        except (LinkError, DeviceRefused) as error:
            return self._failed(error)
        for scan in scans:
            self.ranges.write(_range_data(Time.from_us(ec.now_us), scan))
        return ReturnCode.RTC_OK

    def _failed(self, error: Exception) -> ReturnCode:
        _LOG.error("%s: %s", self.instance_name, error)
        self._close()
        return ReturnCode.RTC_ERROR

    def _close(self) -> None:
        client, self._client = self._client, None
        try:
            if client is not None:
                client.close()
        except LinkError as error:
            _LOG.warning("%s: %s", self.instance_name, error)


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
