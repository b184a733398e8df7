"""The option `--eds NODE=FILE`."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Final

import click

from tickrig.host.cli.options import Decorator
from tickrig.host.cli.refused import Refused, refuse_path
from tickrig.host.monitor.decode.eds_objects import EdsError, EdsObjects, read_eds

NODES: Final = range(1, 128)

eds_option: Final[Decorator] = click.option(
    "--eds",
    multiple=True,
    metavar="NODE=FILE",
    help="EDS or DCF of a node, as 5=drive.eds; names its objects.",
)


def read_eds_option(words: Sequence[str]) -> dict[int, EdsObjects]:
    """Read the files that are named.

    Raises:
        Refused: not NODE=FILE, or a file that cannot be read.
    """
    found = {}
    for word in words:
        node, _, file = word.partition("=")
        if not (node.isdecimal() and int(node) in NODES and file):
            raise Refused(f"--eds {word!r} is not NODE=FILE with a node-ID of 1 to 127, as 5=a.eds")
        try:
            found[int(node)] = read_eds(Path(file), int(node))
        except OSError as error:
            refuse_path("EDS", error)
        except EdsError as error:
            raise Refused(str(error)) from None
    return found
