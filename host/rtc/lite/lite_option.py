"""`--lite NAME=URL[@BAUD]`: devices of RTC-Lite as the command line of `tickrig rtc` names them."""

from __future__ import annotations

import re
from contextlib import ExitStack, closing
from typing import Final

from tickrig.host.cli.messages import say
from tickrig.host.cli.refused import Refused
from tickrig.host.links.errors import LinkClosed
from tickrig.host.links.reopening_link import ReopeningLink
from tickrig.host.links.serial_link import SerialLink
from tickrig.host.rtc.lite.attachment import RATE_HZ, attach
from tickrig.host.rtc.lite.events import ProxyEvent
from tickrig.host.rtc.lite.settings import ProxySettings
from tickrig.host.rtc.system.manager import Manager

BAUD: Final = 57_600

_WORD: Final = re.compile(r"([A-Za-z]\w*)=(.+?)(?:@(\d{1,8}))?", re.ASCII)


def attach_lite(
    manager: Manager, word: str, stack: ExitStack, boot_us: int, rate_hz: float | None
) -> None:
    """Open a device's line and add its proxy, which comes back when the device does.

    Args:
        manager: of the system.
        word: `NAME=URL[@BAUD]`; the proxy is `NAME0`.
        stack: closes the line.
        boot_us: silence after the line was opened.
        rate_hz: of the proxy; 10 Hz if None.

    Raises:
        Refused: no such word, no such line, or nobody answers there.
    """
    name, url, baud = parse_lite(word)
    settings = ProxySettings(boot_us=boot_us, rediscover=True)
    try:
        link = stack.enter_context(closing(ReopeningLink(lambda: SerialLink(url, baud))))
        attach(manager, link, name, settings, listener=_report, rate_hz=rate_hz or RATE_HZ)
    except (LinkClosed, ValueError) as error:
        raise Refused(f"--lite {word}: {error}") from None


def parse_lite(word: str) -> tuple[str, str, int]:
    """Read name, URL and bit rate; Refused if it is not so written.

    >>> parse_lite("LiteA=/dev/ttyUSB0"), parse_lite("B=socket://localhost:7000@9600")
    (('LiteA', '/dev/ttyUSB0', 57600), ('B', 'socket://localhost:7000', 9600))
    """
    match = _WORD.fullmatch(word)
    if match is None:
        raise Refused(f"--lite {word!r} is not NAME=URL[@BAUD], as LiteA=/dev/ttyUSB0@57600")
    return match[1], match[2], int(match[3] or BAUD)


def _report(event: ProxyEvent) -> None:
    say(str(event))
