"""What the command lines of a server have in common: its files, and its bus."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Final, TextIO

import click

from tickrig.host.cli.can_options import BusOptions, open_raw
from tickrig.host.cli.messages import NEEDS_YAML, Refused, refuse_path, show_findings
from tickrig.host.cli.options import Decorator
from tickrig.host.cli.start import loading
from tickrig.host.links.link import StampedLink
from tickrig.host.rtc.component import RtComponent
from tickrig.host.text.user_file import explain_error, find_class

if TYPE_CHECKING:
    from tickrig.host.links.can_link import CanLink
    from tickrig.host.rtc.canopen.definition import BusEntry
    from tickrig.host.rtc.canopen.events import EventListener, ServerEvent
    from tickrig.host.rtc.canopen.server import RtcCanopenServer
    from tickrig.wire.can import ErrorState

STANDARD_OUTPUT: Final = Path("-")


component_option: Final[Decorator] = click.option(
    "--component",
    "components",
    multiple=True,
    metavar="NAME=FILE.py:Class",
    help="An RT component beside the proxies, Active at once; may be repeated.",
)


def read_server(file: Path, components: Sequence[str]) -> RtcCanopenServer:
    """Make the server of a System Definition, with components; Refused if one cannot be used.

    What is wrong in its EDS files, and not used, is told on standard error.
    """
    try:
        with loading():
            from tickrig.host.rtc.canopen.serve import open_server  # noqa: PLC0415 - slow
    except ModuleNotFoundError:
        raise Refused(NEEDS_YAML) from None
    try:
        server = open_server(file)
        add_components(server, components)
    except OSError as error:
        refuse_path("file", error)
    except ValueError as error:
        raise Refused(str(error)) from None
    show_findings(server.findings)
    return server


def add_components(server: RtcCanopenServer, words: Sequence[str]) -> None:
    """Put components of users' files beside the proxies.

    Args:
        server: they run at the rate of its proxies.
        words: as `Logger0=parts.py:Logger`.

    Raises:
        ValueError: one cannot be.
    """
    for word in words:
        name, equals, spec = word.partition("=")
        if not (name and equals):
            raise ValueError(f"--component {word!r} is not NAME=FILE.py:Class")
        file = spec.rpartition(":")[0]
        try:
            component = find_class(spec, RtComponent)(name)
            server.manager.add(component, server.definition.master.rate_hz)
            server.manager.activate(name)
        except Exception as error:  # a user's file may raise anything
            raise ValueError(f"--component {name}: {explain_error(error, file)}") from error


def open_link(
    options: BusOptions, bus_state: Callable[[ErrorState], None], stack: ExitStack
) -> tuple[StampedLink, str]:
    """Open the bus of a server; return it, and how people call it.

    Args:
        options: which bus.
        bus_state: called with what its CAN controller reports.
        stack: closes it.
    """
    from tickrig.host.links.can_link import CanLink  # noqa: PLC0415 - slow
    from tickrig.host.links.echo import free_of_echo  # noqa: PLC0415 - with it

    bus, interface, channel = open_raw(options)
    link = CanLink(bus, f"{interface}:{channel}", drops=True)
    stack.callback(_close, link)
    link.on_error_state = bus_state
    name = f"{interface} {channel}"
    return free_of_echo(link, interface), name


def bus_of(options: BusOptions, entry: BusEntry) -> BusOptions:
    """Return the bus of the command line, that of the file where it names none."""
    if options or entry.channel is None:
        return options
    return replace(
        options,
        interface=entry.interface or "socketcan",
        channel=entry.channel,
        bitrate=options.bitrate or entry.bitrate,
    )


def log_listener(log: Path | None, stack: ExitStack) -> Iterator[EventListener]:
    """Yield what writes events to a file, if there is one."""
    if log == STANDARD_OUTPUT:
        yield lambda event: click.echo(event.to_json())
    elif log is not None:
        try:
            file = stack.enter_context(log.open("w", encoding="utf-8", buffering=1))
        except OSError as error:
            refuse_path("--log", error)
        yield lambda event: _write(file, event)


def _write(file: TextIO, event: ServerEvent) -> None:
    file.write(f"{event.to_json()}\n")


def _close(link: CanLink) -> None:
    if link.lost:
        click.echo(f"{link.lost} frames were lost: the bus took none", err=True)
    if link.reads.faults:
        click.echo(f"the driver could not read {link.reads.faults} frames", err=True)
    link.close()
