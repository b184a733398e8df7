"""The verb `tui`, which runs the monitor as a full-screen program."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from tickrig._lazy import LazyModule
from tickrig.host.canmon import eds_document
from tickrig.host.canmon.output.listening import bit_rates_of, report
from tickrig.host.canmon.verbs import decode_options
from tickrig.host.canmon.workspace import MonitorSetup, PanelSettings, Workspace, WorkspaceError
from tickrig.host.cli.can_options import BusOptions
from tickrig.host.cli.messages import Refused, refusing, say
from tickrig.host.cli.options import PATH
from tickrig.host.cli.start import loading

if TYPE_CHECKING:
    from tickrig.host.canmon.tui import app
    from tickrig.host.canmon.tui import session as sessions
    from tickrig.host.canmon.tui.panels import panel
else:  # an extra
    app = LazyModule("tickrig.host.canmon.tui.app")
    sessions = LazyModule("tickrig.host.canmon.tui.session")
    panel = LazyModule("tickrig.host.canmon.tui.panels.panel")


@decode_options.source_command(
    click.option(
        "-w",
        "--workspace",
        "path",
        type=PATH,
        metavar="FILE",
        help="Load and store the settings in FILE.",
    ),
    decode_options.decode_options,
    decode_options.reopen_option,
)
def command(  # noqa: PLR0913 - options
    *,
    source: Sequence[str],
    path: Path | None,
    eds: decode_options.EdsOptions,
    dbc: Sequence[Path],
    reopen: bool,
    strict: bool,
    **options: Any,
) -> None:
    """Show all there is in tabs: trace, nodes, statistics and more (extra tickrig[tui]).

    Without a SOURCE, the settings (F2) ask for one. The monitor only listens until it is armed (A).
    With -w, all settings are loaded from a TOML file and stored there, including buses and EDS
    files. The command line takes precedence over this file.

    \b
    canmon tui can0 -b 500000
    canmon tui can0 --eds 3=drive.eds -w bench.toml
    canmon tui -w bench.toml
    canmon tui run.log
    canmon tui
    ssh robot canmon dump can0 --jsonl | canmon tui -

    Keys: 1 to 9 tabs, F1 help, F2 settings, F3 times, ctrl+p commands, A arm,
    F9 stop all, F8 record, F4 trigger, F12 picture, q quit.

    {source}
    """  # noqa: D301 - click wants the backspace
    said = MonitorSetup(
        source=tuple(source),
        options=BusOptions(**options),
        eds=eds_document.eds_paths(eds.words),
        dbc=tuple(dbc),
        eds_dir=eds.folders,
    )
    monitor = _monitor(path, said, asks=sys.stdout.isatty())
    if not sys.stdout.isatty():
        monitor.session.source.close()
        raise Refused("canmon tui needs a terminal; canmon top prints a table without one")
    if reopen:
        monitor.session.source.reopen()
        monitor.reopens = True
    try:
        monitor.run_session()
    finally:
        monitor.session.source.close()
    report(monitor.session.source, strict)


def _monitor(path: Path | None, said: MonitorSetup, *, asks: bool) -> app.MonitorApp:
    """Make the app, with the settings of the workspace in its panels.

    Args:
        path: path of the workspace.
        said: settings on the command line.
        asks: whether to show the settings screen if no source is named, so that the user enters
            one.
    """
    try:
        with loading():
            make_app, make_panels = app.MonitorApp, panel.make_panels
    except ImportError as error:
        raise Refused(f"canmon tui needs Textual: pip install 'tickrig[tui]' ({error})") from None
    with refusing("", WorkspaceError):
        workspace = Workspace() if path is None else Workspace.read(path)
        setup = MonitorSetup.read(workspace).under(said)
        objects = eds_document.read_eds_paths(setup.eds, setup.eds_dir)
        with decode_options.refusing_dbc():
            model = sessions.Model(objects, setup.dbc, *bit_rates_of(setup.source, setup.options))
        asks = asks and not (setup.source or setup.options)
        if asks:
            session = sessions.empty_session(model)
        else:
            session = sessions.open_session(setup.source, setup.options, model)
        try:
            panels = make_panels(session, say)
            recorder = app.RecorderTask(session)
            panel_settings = PanelSettings(workspace, setup, [*panels, recorder])
            panel_settings.load()
        except BaseException:
            session.source.close()
            raise
    monitor = make_app(session, panels, panel_settings, recorder)
    monitor.asks = asks
    return monitor
