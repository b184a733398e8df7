"""What the RRC client raises beside LinkTimeout and LinkClosed.

DeviceRefused            (tickrig.host.links.errors)
 +-- RrcRefused          ER: came for one command
 +-- RrcStopped          ER: came too many times in a row; the client sends no more
"""

from __future__ import annotations

from typing import Final

from tickrig.host.links.errors import DeviceRefused
from tickrig.wire.rrc.replies import COMMAND_CHECKSUM, COMMAND_UNKNOWN, RECEIVE_BUFFER_OVERFLOW

_ONLY_WHILE_ON: Final = (
    "allowed only while VR2 is on, from EV:PowerOnSuccess up to EV:PowerOffWaitBy...;"
    " was its power button pressed?"
)
_BAD_PARAMETERS: Final = (
    "bad parameters as the RRC sees them: noise on the line, or the RRC was restarted and wants"
    " no CHECK any more (then call start() again)"
)
_HINTS: Final = {
    COMMAND_CHECKSUM: (
        "CHECK was missing or wrong: noise on the line, or stablemode was on before this client"
        " came (then call start() again)"
    ),
    COMMAND_UNKNOWN: "allowed are the 12 commands of the manual: noise on the line?",
    RECEIVE_BUFFER_OVERFLOW: (
        "send at most 160 lines a second with stablemode, 100 without, and 45 while VR2 is off"
    ),
    **dict.fromkeys(("limit", "output", "poweroff"), _ONLY_WHILE_ON),
}


class RrcRefused(DeviceRefused):
    """The RRC answered a command with ER.

    Attributes:
        code: the reason as the RRC gave it: a command's name, or `CommandChecksum`, ...
        sent: the line that was refused, without LF.
    """

    def __init__(self, sent: str, code: str) -> None:
        hint = _HINTS.get(code, _BAD_PARAMETERS)
        super().__init__(f"sent {sent!r}, the RRC answered ER:{code}: {hint}", code)
        self.sent = sent


class RrcStopped(DeviceRefused):
    """The RRC refused too many times in a row, and the client sends no more commands.

    It ends with EV:Initialized, EV:PowerOffFinished or `RrcClient.resume()`.

    Attributes:
        code: the last reason.
    """

    def __init__(self, what: str, code: str) -> None:
        super().__init__(f"{what} (last answer ER:{code}); resume() lifts the stop", code)
