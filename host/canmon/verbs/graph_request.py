"""What of a graph is wanted."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final, Self

from tickrig.host.canmon.output.graph_file import check_graph_path
from tickrig.host.cli.refused import Refused
from tickrig.host.monitor.graph.series import Series
from tickrig.host.monitor.graph.view import View
from tickrig.host.text.values import parse_time_us

_SIZE: Final = re.compile(r"([0-9]{2,4})x([0-9]{2,4})")
_RANGE: Final = re.compile(r"([1-9])=(-?[0-9.eE+-]+?)\.\.(-?[0-9.eE+-]+)")


@dataclass(frozen=True, slots=True, kw_only=True)
class GraphRequest:
    """The options of the verb `graph`, read.

    Attributes:
        files: files to write.
        from_us: beginning of the view after the first sample, None for all.
        to_us: its end, likewise.
        at_us: what is read out, likewise.
        ranges: of axes.
        size: of a picture in pixels.
        window_us: what is shown of a bus.
        span_us: how long a bus is heard, None where it was not said.
    """

    files: tuple[Path, ...]
    from_us: int | None
    to_us: int | None
    at_us: int | None
    ranges: dict[int, tuple[float, float]]
    size: tuple[int, int]
    window_us: int
    span_us: int | None

    @classmethod
    def of(cls, options: dict[str, Any]) -> Self:
        """Take the options that are its own; Refused if one is wrong."""
        files = options.pop("files")
        for file in files:
            check_graph_path(file)
        return cls(
            files=files,
            from_us=_time_us("--from", options.pop("from_")),
            to_us=_time_us("--to", options.pop("to")),
            at_us=_time_us("--at", options.pop("at")),
            ranges=dict(map(_range, options.pop("ranges"))),
            size=_size(options.pop("size")),
            window_us=_time_us("--window", options.pop("window")) or 1,
            span_us=options.pop("span_us"),
        )

    def view(self, series: Sequence[Series]) -> View:
        """Return the view that is asked for; Refused if nothing is in it."""
        whole = View.of(series)
        first_us = whole.from_us
        try:
            return View(
                first_us + (self.from_us or 0),
                whole.to_us if self.to_us is None else first_us + self.to_us,
                self.ranges,
                None if self.at_us is None else first_us + self.at_us,
                first_us,
            )
        except ValueError as error:
            raise Refused(str(error)) from None


def _time_us(option: str, text: str | None) -> int | None:
    try:
        return None if text is None else parse_time_us(text)
    except ValueError as error:
        raise Refused(f"{option} {error}") from None


def _size(text: str) -> tuple[int, int]:
    match = _SIZE.fullmatch(text)
    if match is None:
        raise Refused(f"--size {text!r} is not WIDTHxHEIGHT in pixels, as 960x400")
    return int(match[1]), int(match[2])


def _range(text: str) -> tuple[int, tuple[float, float]]:
    match = _RANGE.fullmatch(text)
    try:
        if match is None:
            raise ValueError
        low, high = float(match[2]), float(match[3])
        if not low < high:
            raise ValueError
    except ValueError:
        raise Refused(f"--range {text!r} is not AXIS=LOW..HIGH, as 1=-5..5") from None
    return int(match[1]), (low, high)
