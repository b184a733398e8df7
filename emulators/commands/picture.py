"""Plots of curves in files; needs matplotlib (the extra `plot`)."""

from __future__ import annotations

import io
from importlib.util import find_spec
from pathlib import Path
from typing import TYPE_CHECKING, Final

from tickrig._lazy import LazyModule
from tickrig.host.cli.messages import Refused

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tickrig.host.text import whole_file
else:  # completion does without
    whole_file = LazyModule("tickrig.host.text.whole_file")

_FORMATS: Final = (".png", ".svg", ".html")
_PLOTTER: Final = "matplotlib"


def check_plot(path: Path, option: str = "--plot", *others: str) -> None:
    """Check before a run that a picture of the run can be written when the run is over.

    If the picture cannot be written, the command ends with a message.

    Args:
        path: path of the picture.
        option: the option with the path, for the message.
        others: suffixes that the option accepts in addition to the suffixes of pictures. They
            appear only in the message.
    """
    if path.suffix.lower() not in _FORMATS:
        raise Refused(f"{option} {path}: the name ends in {', '.join((*_FORMATS, *others))}")
    if find_spec(_PLOTTER) is None:
        raise Refused(f"{option} needs {_PLOTTER}: pip install 'tickrig[plot]'")
    try:
        whole_file.check_file(path, option)
    except ValueError as error:
        raise Refused(str(error)) from None


def new_figure(width_in: float, height_in: float) -> Figure:
    """Return an empty figure."""
    from matplotlib.figure import Figure  # noqa: PLC0415 - heavy, and an extra

    return Figure(figsize=(width_in, height_in), layout="constrained")


def write_figure(figure: Figure, title: str, path: Path) -> None:
    """Write a matplotlib figure as PNG, SVG or HTML, according to the suffix of the file.

    Args:
        figure: the figure.
        title: title of the HTML page.
        path: path of the file.

    Raises:
        OSError: the file cannot be written.
    """
    if path.suffix.lower() == ".html":
        whole_file.write_whole(path, _page(figure, title))
    else:
        picture = io.BytesIO()
        figure.savefig(picture, format=path.suffix.lower().removeprefix("."))
        whole_file.write_whole(path, picture.getvalue())


def _page(figure: Figure, title: str) -> str:
    drawing = io.StringIO()
    figure.savefig(drawing, format="svg")
    picture = drawing.getvalue()
    return (
        f'<!DOCTYPE html>\n<html lang="en">\n<head><meta charset="utf-8"><title>{title}</title>'
        f"</head>\n<body>\n{picture[picture.index('<svg') :]}</body>\n</html>\n"
    )
