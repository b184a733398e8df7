"""Files that curves are written to."""

from __future__ import annotations

from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import Final

from tickrig.host.canmon.errors import SourceFailed
from tickrig.host.cli.refused import Refused
from tickrig.host.monitor.graph.series import Series, View

KINDS: Final = (".svg", ".html", ".png", ".csv")


def check_graph_path(path: Path) -> None:
    """Refuse a file whose name tells no kind."""
    if path.suffix.lower() not in KINDS:
        raise Refused(f"-o {path}: a graph is written as {', '.join(KINDS)}")


def write_graph(path: Path, series: Sequence[Series], view: View, size: tuple[int, int]) -> None:
    """Write curves as the file's name says.

    Args:
        path: its suffix is one of `KINDS`.
        series: the curves.
        view: what is seen.
        size: width and height of a picture in pixels.

    Raises:
        Refused: matplotlib is not there, for PNG.
        SourceFailed: the file cannot be written.
    """
    try:
        _write(path, series, view, size)
    except OSError as error:
        raise SourceFailed(f"{path}: {error.strerror}") from error
    except ImportError:
        raise Refused(f"{path}: PNG needs matplotlib: pip install 'tickrig[plot]'") from None


def _write(path: Path, series: Sequence[Series], view: View, size: tuple[int, int]) -> None:
    match path.suffix.lower():
        case ".svg":
            from tickrig.host.monitor.graph.svg import svg  # noqa: PLC0415 - one kind is wanted

            path.write_text(svg(series, view, *size), "utf-8")
        case ".html":
            from tickrig.host.monitor.graph.svg import html_page  # noqa: PLC0415

            path.write_text(html_page(series, view, *size, title=path.stem), "utf-8")
        case ".csv":
            from tickrig.host.monitor.graph.csv_text import write_csv  # noqa: PLC0415

            with path.open("w", encoding="utf-8", newline="") as file:
                write_csv(file, series, view)
        case _:
            from tickrig.host.monitor.graph.png import write_png  # noqa: PLC0415

            picture = BytesIO()
            write_png(picture, series, view, *size)
            path.write_bytes(picture.getvalue())
