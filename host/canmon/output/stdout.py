"""Standard output of a verb that prints many lines."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from tickrig.host.canmon.output.meaning import Meant
from tickrig.host.canmon.output.printer import Output, Printer
from tickrig.host.monitor.logs.reading.csv_line import DUMP_HEADER
from tickrig.host.monitor.logs.reading.json_line import drop_line


class Printed:
    """Lines on standard output; in JSON, losses among them."""

    def __init__(self, printer: Printer, output: Output) -> None:
        self._printer, self._output, self._lost = printer, output, 0
        self._header = output is Output.CSV

    def take(self, meant: Sequence[Meant], lost: int) -> None:
        """Print frames, at once."""
        lines = [DUMP_HEADER] if self._header else []
        lines += [self._printer(*one) for one in meant]
        if lost != self._lost and self._output is Output.JSONL:
            lines.append(drop_line(lost - self._lost))
        self._header, self._lost = False, lost
        if lines:
            sys.stdout.write("\n".join(lines) + "\n")
            sys.stdout.flush()
