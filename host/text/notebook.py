"""Tables and listings as HTML for Jupyter. Markup in texts of others has no effect.

A notebook inserts the result of `_repr_html_` into its own page, which does not have the style
sheet and the content security policy of tickrig. Therefore every text is escaped, and invisible
characters are spelt out. The HTML has no links, scripts or addresses.

>>> listing(["<b>"])[-15:]
'&lt;b&gt;</pre>'
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import islice
from typing import Final

_MOST_CHARACTERS: Final = 400
_LEFT: Final = ' style="text-align:left"'
_LISTING: Final = ' style="max-height:30em;overflow:auto;font-family:monospace;line-height:1.3"'


def text(value: object) -> str:
    """Return a value as text for HTML, with special characters escaped.

    A long text is cut, and the number of omitted characters is added.
    """
    shown = str(value)
    more = len(shown) - _MOST_CHARACTERS
    if more > 0:
        shown = f"{shown[:_MOST_CHARACTERS]} … {more} more"
    from html import escape  # noqa: PLC0415 - only notebooks need it

    from tickrig.host.text.page_text import harmless  # noqa: PLC0415 - as above

    return escape(str(harmless(shown)))


def heading(title: str, *facts: object) -> str:
    """Return an HTML title with facts beside it."""
    return f"<p><b>{text(title)}</b> {text(' · '.join(map(str, facts)))}</p>"


def table(
    columns: Sequence[str],
    rows: Iterable[Sequence[object]],
    title: str = "",
    *,
    opened: bool = False,
    most: int = 200,
) -> str:
    """Return rows as an HTML table for a notebook, or an empty text if there are no rows.

    Args:
        columns: titles of the columns.
        rows: cells of the rows.
        title: title of the table. A table with a title can be folded.
        opened: whether a foldable table is unfolded at first.
        most: maximum number of shown rows. A line below the table has the number of omitted rows.
    """
    every = iter(rows)
    shown = list(islice(every, most))
    if not shown:
        return ""
    left_out = sum(1 for _ in every)
    head = "".join(f"<th{_LEFT}>{text(one)}</th>" for one in columns)
    body = "".join(
        f"<tr>{''.join(f'<td{_LEFT}>{text(cell)}</td>' for cell in row)}</tr>" for row in shown
    )
    drawn = f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>"
    if left_out:
        drawn += f"<p>… {left_out} more</p>"
    if not title:
        return drawn
    number = len(shown) + left_out
    state = " open" if opened else ""
    return f"<details{state}><summary>{text(title)} ({number})</summary>{drawn}</details>"


def listing(lines: Sequence[str], most: int = 1_000) -> str:
    """Return the last lines of a text as a scrollable HTML box for a notebook.

    If lines are omitted, their number is shown above.
    """
    left_out = len(lines) - most
    above = f"… {left_out} earlier lines\n" if left_out > 0 else ""
    return f"<pre{_LISTING}>{above}{chr(10).join(map(text, lines[-most:]))}</pre>"
