"""What `rtc-lite-emu` runs."""

from __future__ import annotations

from typing import Any, Final

import click

from tickrig.device.rtc_lite.config import DEFAULT_RATE_HZ, NodeConfig
from tickrig.device.rtc_lite.node import RtcLiteNode
from tickrig.emulators.commands.serial_run import DeviceType, Options, SerialRun
from tickrig.emulators.record.wire_log import WireLine
from tickrig.emulators.rtc_lite.build import NAME, config_to_trace
from tickrig.emulators.rtc_lite.components import COMPONENTS, find_component
from tickrig.emulators.rtc_lite.faults import LINE_FAULTS
from tickrig.emulators.rtc_lite.frame_log import frame_splitter
from tickrig.emulators.rtc_lite.verbs import verbs
from tickrig.emulators.serial.emulator import LineSettings
from tickrig.host.cli.refused import Refused, refused_at
from tickrig.host.text.user_file import explain_error
from tickrig.wire.rtc_lite.codes import Command, ContextType
from tickrig.wire.rtc_lite.frame import Checksum, Framing

ROUTINE: Final = tuple(
    command.value
    for command in (Command.PING, Command.EXECUTE, Command.ERROR, Command.WRITE, Command.DATA)
)
"""What -v leaves out: the traffic of each period."""


def emulate(  # noqa: PLR0913, PLR0917 - the command line
    node: str,
    baud: int,
    timer_hz: int | None,
    framing: str,
    checksum: str,
    options: dict[str, Any],
) -> int:
    """Run a node as the command line says, and return the exit status."""
    ec = ContextType.TIMER if timer_hz else ContextType.PROXY
    with refused_at("--checksum"):
        config = NodeConfig(Framing(framing), Checksum(checksum), ec, timer_hz or DEFAULT_RATE_HZ)
    with refused_at("--node"):
        device = RtcLiteNode(find_component(node), config)
    kind = DeviceType(
        NAME,
        f"RTC-Lite node {device.component.type_name}",
        is_event=_is_event,
        senders=verbs(device.component, config),
        line=LineSettings(baud, LINE_FAULTS, frame_splitter(config)),
        talk=lambda link, baud: (
            f" Its proxy opens this path:\n  tickrig rtc run SYSTEM.toml --lite NAME={link}@{baud}"
        ),
    )
    run = SerialRun(kind, device, config_to_trace(node, config), Options(**options))
    return _run(run, node)


def _run(run: SerialRun, node: str) -> int:
    """Run, and say in a line what a user's callback raised."""
    if node in COMPONENTS:
        return run.run()
    file = node.rpartition(":")[0]
    try:
        return run.run()
    except click.ClickException:
        raise
    except Exception as error:  # a user's callback may raise anything
        raise Refused(f"{node}: {explain_error(error, file)}") from error


def _is_event(line: WireLine) -> bool:
    return line.data[:2] not in ROUTINE
