"""The applications of the report's node: range finder (Fig. 122), position detection (Fig. 123)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Final, Protocol

from tickrig.emulators.tkernel.node.node_manager import NodeManager
from tickrig.host.links.link import Link
from tickrig.host.rtc.motion.options.lrf_capture_urg import LrfCaptureUrg
from tickrig.host.rtc.ucode.contents_interpretation import ContentsInterpretation
from tickrig.host.rtc.ucode.infrared_rays_reader import InfraredRaysReader
from tickrig.host.rtc.ucode.source import OpenSource, Source
from tickrig.host.rtc.ucode.ucode_settlement import UcodeSettlement

RANGE_FINDER: Final = "LRFCapture_URG0"
READER: Final = "InfraredRaysReader0"
SETTLEMENT: Final = "UcodeSettlement0"
CONTENTS: Final = "ContentsInterpretation0"

OpenLine = Callable[[str], Link[bytes]]


class _Closable(Protocol):
    def close(self) -> None: ...


class BoardLines:
    """What the components of a board open; it can be cut.

    Args:
        open_urg: opens the line of a range finder.
        open_reader: opens the line of a ucode reader.
        open_source: makes what asks the resolution service.
    """

    def __init__(self, open_urg: OpenLine, open_reader: OpenLine, open_source: OpenSource) -> None:
        self._open_urg, self._open_reader, self._open_source = open_urg, open_reader, open_source
        self._opened: list[_Closable] = []

    def open_urg(self, name: str) -> Link[bytes]:
        """Open the line of a range finder."""
        self._opened.append(link := self._open_urg(name))
        return link

    def open_reader(self, name: str) -> Link[bytes]:
        """Open the line of a ucode reader."""
        self._opened.append(link := self._open_reader(name))
        return link

    def open_source(self, name: str, hosts: tuple[str, ...]) -> Source:
        """Make what asks the resolution service."""
        self._opened.append(source := self._open_source(name, hosts))
        return source

    def cut(self) -> None:
        """Close all that was opened, without a word to any device."""
        for opened in self._opened:
            opened.close()
        self._opened.clear()


def add_range_finder(manager: NodeManager, lines: BoardLines, device: str) -> None:
    """Add and activate the component of a range finder at a line."""
    component = manager.add(LrfCaptureUrg(RANGE_FINDER, lines.open_urg))
    component.configuration.set("DeviceFileName", device)
    manager.activate(RANGE_FINDER)


def add_position_detection(
    manager: NodeManager, lines: BoardLines, device: str, service: str = ""
) -> None:
    """Add, join and activate reader, settlement and interpretation.

    Args:
        manager: of the node.
        lines: open what they need.
        device: line of the reader.
        service: address of the resolution service; that of the component if left out.
    """
    reader = manager.add(InfraredRaysReader(READER, lines.open_reader))
    reader.configuration.set("DeviceFileName", device)
    settlement = manager.add(UcodeSettlement(SETTLEMENT, lines.open_source))
    if service:
        settlement.configuration.set("service", service)
    manager.add(ContentsInterpretation(CONTENTS, lines.open_source))
    manager.connect(f"{READER}.ucodes", f"{SETTLEMENT}.ucodes")
    manager.connect(f"{SETTLEMENT}.addresses", f"{CONTENTS}.addresses")
    manager.activate(READER, SETTLEMENT, CONTENTS)
