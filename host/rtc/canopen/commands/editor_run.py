"""The work of rtc-canopen-editor after its options are read, which needs the extra `tui`."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import Refused, SourceFailed
from tickrig.host.links.link import LinkClosed
from tickrig.host.rtc.canopen.commands import opening
from tickrig.host.rtc.canopen.editor.app import SystemEditor
from tickrig.host.rtc.canopen.editor.session import EditorSession
from tickrig.wire.can import ErrorState


def run_editor(
    file: Path, log: Path | None, components: Sequence[str], start: bool, bus_options: BusOptions
) -> None:
    """Run a server for a System Definition, and show the terminal editor for it.

    Args:
        file: path of the System Definition.
        log: file to which events are written, with one line of JSON per event.
        components: components in files of the user, such as `Logger0=parts.py:Logger`.
        start: whether to activate all nodes.
        bus_options: options of the command line that select the bus.
    """
    if log == opening.STANDARD_OUTPUT:
        raise Refused("--log -: the screen is on standard output; name a file")
    server = opening.read_server(file, components)
    if not sys.stdout.isatty():
        raise Refused("the editor needs a terminal; rtc-canopen-server does without one")
    with ExitStack() as stack:
        listeners = tuple(opening.log_listener(log, stack))
        bus = opening.bus_of(bus_options, server.definition.bus)

        def bus_state(state: ErrorState) -> None:
            session.bus_state(state)

        link, name = opening.open_link(bus, bus_state, stack)
        session = EditorSession(
            server, file, link, lambda other: opening.add_components(other, components), listeners
        )
        if start:
            server.start()
        try:
            SystemEditor(session, name).run_session()
        except LinkClosed as error:
            raise SourceFailed(str(error)) from None
