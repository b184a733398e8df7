"""What a sequence expects by name: the latest frame, decoded."""

from __future__ import annotations

from collections.abc import Mapping

from tickrig.host.monitor.decode.decoder import Decoder
from tickrig.host.monitor.decode.objects.eds_objects import EdsObjects
from tickrig.host.monitor.frames.heard import Heard
from tickrig.host.monitor.sequence.heard_condition import HeardCondition
from tickrig.host.monitor.sequence.steps import Condition


class Watch:
    """Decodes all that is heard, for conditions on it.

    Attributes:
        eds: what files say, by node-ID.
    """

    def __init__(self, eds: Mapping[int, EdsObjects]) -> None:
        self.eds = eds
        self._decoder, self._latest = Decoder(eds), HeardCondition()

    def take(self, heard: Heard) -> None:
        """Decode a frame; conditions are asked about it next."""
        self._latest.take(heard, self._decoder.take(heard))

    def condition(self, text: str) -> Condition:
        """Return the condition of a filter expression; ValueError if it is none."""
        return self._latest.condition(text)
