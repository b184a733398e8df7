"""The operator panel for small terminals: 60 columns, 15 lines."""

from __future__ import annotations

from rich.text import Text

from tickrig.emulators.rrc import panel_text
from tickrig.emulators.rrc.panel_text import PanelView
from tickrig.host.rrc.gauges import DIM, bar, scale, signed


def outputs_pane(view: PanelView) -> Text:
    """Show the state of the RRC, and stick and output side by side."""
    rows = [
        Text(" ").join([panel_text.state_of(view), *panel_text.lamps(view)]),
        Text.assemble(
            (f"{f'stick {panel_text.stick_hint(view)}':<27}", "bold"),
            " load ",
            panel_text.load(view),
            f" ≤{view.number('pace_lines_s')}/s",
        ),
        *(
            Text.assemble(f"{axis} stick {signed(view.number(f'stick_{axis}_pct'))}  out ", shown)
            for axis, shown in (
                ("v", bar(view.number("out_v_pct"))),
                ("w", bar(view.number("out_w_pct"))),
            )
        ),
        Text.assemble(
            "speed ",
            scale(view.number("speed_mode"), 5),
            f"  gear {view.values.get('gear', '?')}  gauge ",
            scale(view.number("gauge"), 10),
        ),
    ]
    return Text("\n").join(rows)


def controls_pane(view: PanelView) -> Text:
    """Show the pressed buttons and the active faults."""
    shown = panel_text.faults(view, 0)
    rows = [Text("  ").join(shown[at : at + 3]) for at in range(0, len(shown), 3)]
    return Text("\n").join([panel_text.buttons(view), *rows])


def report_line(view: PanelView) -> Text:
    """Return the latest status `SA` of the RRC as a line of the panel.

    The line contains the counters of the speed and alarm buttons.
    """
    if (sa := view.decoded) is None:
        return Text(view.report)
    return Text(
        f"in {sa.in_v_pct:+} {sa.in_w_pct:+} out {sa.out_v_pct:+} {sa.out_w_pct:+}"
        f" gauge {sa.gauge} speed {sa.speed_mode}"
        f" keys {sa.speed_up_count} {sa.speed_down_count} {sa.alarm_count}",
        style=DIM,
    )
