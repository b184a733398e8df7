"""Segments of a segmented SDO transfer, as a third party hears them."""

from __future__ import annotations

from tickrig.host.monitor.decode.sdo.sdo_open import OpenTransfer
from tickrig.wire.canopen.sdo.sdo import DownloadSegmentResponse, Segment, UploadSegmentRequest


def ask_segment(running: OpenTransfer, request: UploadSegmentRequest) -> str:
    """Take what a client of an upload asks for."""
    running.retries += running.asked == request.toggle
    running.asked = request.toggle
    return f"asks for a segment, {running.progress} so far"


def take_segment(running: OpenTransfer, segment: Segment) -> str:
    """Take a segment of an upload, unless it was sent twice or a toggle bit is wrong."""
    if segment.toggle != running.asked or segment.toggle == running.taken:
        return "segment with the wrong toggle bit, or sent again"
    running.taken = segment.toggle
    running.data += segment.data
    running.done = segment.last
    return f"segment, {running.progress}"


def send_segment(running: OpenTransfer, segment: Segment) -> str:
    """Take a segment of a download; it counts when the server has confirmed it."""
    again = running.sent is not None and running.sent.toggle == segment.toggle
    running.retries += again or segment.toggle == running.taken
    running.sent = segment
    return f"segment of {len(segment.data)} B, {running.progress} so far"


def confirm_segment(running: OpenTransfer, response: DownloadSegmentResponse) -> str:
    """Take the receipt of a segment."""
    sent = running.sent
    if sent is None or sent.toggle != response.toggle or sent.toggle == running.taken:
        return "receipt of no segment that was heard, or of one sent again"
    running.taken, running.sent = sent.toggle, None
    running.data += sent.data
    running.done = sent.last
    return f"segment confirmed, {running.progress}"
