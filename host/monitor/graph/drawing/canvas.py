"""Dots of braille letters: two a cell across, four down.

>>> canvas = Canvas(2, 1)
>>> for x in range(4):
...     canvas.fill(x, x, x)
>>> [text for text, _ in canvas.row(0)]
['⠑', '⢄']
"""

from __future__ import annotations

from typing import Final

DOTS_X: Final = 2
DOTS_Y: Final = 4

_BLANK: Final = 0x2800
_LEFT: Final = (0x01, 0x02, 0x04, 0x40)
_RIGHT: Final = (0x08, 0x10, 0x20, 0x80)


def _letter(dots: int) -> str:
    rows = range(DOTS_Y)
    left = sum(_LEFT[row] for row in rows if dots >> row & 1)
    right = sum(_RIGHT[row] for row in rows if dots >> row + DOTS_Y & 1)
    return chr(_BLANK + left + right) if dots else " "


_LETTERS: Final = tuple(_letter(dots) for dots in range(256))
"""By the dots of the left column, then those of the right one, from the top."""


class Canvas:
    """A field of dots in layers; a cell takes the colour of the topmost layer with dots in it.

    Args:
        width: in cells.
        height: in cells.
        layers: how many.
    """

    def __init__(self, width: int, height: int, layers: int = 1) -> None:
        self.width, self.height = width, height
        self._layers = [[0] * (width * DOTS_X) for _ in range(layers)]

    def fill(self, x: int, top: int, bottom: int, layer: int = 0) -> None:
        """Set the dots of a column from one row to another, both included; what is outside is cut.

        Args:
            x: column of dots, within the canvas.
            top: row of dots, 0 at the top.
            bottom: row of dots, not above `top`.
            layer: on which layer.
        """
        top, bottom = max(0, top), min(self.height * DOTS_Y - 1, bottom)
        if top <= bottom:
            self._layers[layer][x] |= (1 << bottom + 1) - (1 << top)

    def row(self, row: int) -> list[tuple[str, int]]:
        """Return the letters of a row of cells, each with its layer, -1 where there is none."""
        shift, cells = row * DOTS_Y, []
        for x in range(0, self.width * DOTS_X, DOTS_X):
            dots, top = 0, -1
            for number, layer in enumerate(self._layers):
                if here := layer[x] >> shift & 0xF | (layer[x + 1] >> shift & 0xF) << DOTS_Y:
                    dots, top = dots | here, number
            cells.append((_LETTERS[dots], top))
        return cells
