"""The PDOs of all slaves, and who works on them in periods."""

from __future__ import annotations

from collections.abc import Mapping

from tickrig.host.canopen.master.cia402.drive_node import DriveNode
from tickrig.host.canopen.master.process_image import ProcessImage
from tickrig.wire.can import CanFrame
from tickrig.wire.instant import NEVER


class ProcessData:
    """Hands frames and SYNCs on to the images and drives of the nodes.

    Args:
        images: by node-ID.
        drives: nodes with axes.
    """

    def __init__(
        self, images: Mapping[int, ProcessImage], drives: tuple[DriveNode, ...] = ()
    ) -> None:
        self.images, self.drives = images, drives
        self._began = False
        self._by_cob_id = {cob_id: image for image in images.values() for cob_id in image.cob_ids}

    @property
    def due_us(self) -> int:
        """When `tick` has something to do."""
        return min((drive.due_us for drive in self.drives), default=NEVER)

    def receive(self, frame: CanFrame) -> None:
        """Take a data frame; one that is no TPDO of a slave is passed over."""
        if (image := self._by_cob_id.get(frame.can_id)) is not None:
            image.receive(frame.can_id, frame.data)

    def sync(self) -> None:
        """Send what goes with a SYNC."""
        for image in self.images.values():
            image.sync()

    def tick(self, now_us: int, *, sync: bool) -> None:
        """Begin the periods that are due; `sync` says that a SYNC was sent just now.

        None begins while slaves boot at the start: ros2_canopen has its drivers wait for them.
        """
        if not self._began:
            if any(drive.is_awaited(now_us) for drive in self.drives):
                return
            self._began = any(drive.is_booted for drive in self.drives)
        for drive in self.drives:
            drive.tick(now_us, sync=sync)
