"""The loggers of the library, which are silent unless the program configures logging."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, cast

if TYPE_CHECKING:
    import logging


class _Logger:
    """The logger of a module, which imports `logging` at its first message.

    Most programs log nothing, and `logging` takes a thirtieth of `from tickrig import Bench`.
    """

    _real: logging.Logger | None = None

    def __init__(self, name: str) -> None:
        self._name = name

    def __reduce__(self) -> tuple[object, ...]:
        """Copy the logger by its name, as `logging` does."""
        return log_of, (self._name,)

    def __getattr__(self, name: str) -> object:
        """Return the attribute of the logger."""
        if self._real is None:
            import logging  # noqa: PLC0415 - slow

            _silence()
            self._real = logging.getLogger(self._name)
        found: object = getattr(self._real, name)
        return found


def log_of(name: str) -> logging.Logger:
    """Return the logger of a module."""
    return cast("logging.Logger", _Logger(name))


def _silence() -> None:
    """Let the messages of the library go nowhere unless the program has handlers."""
    import logging  # noqa: PLC0415 - slow

    library = logging.getLogger("tickrig")
    if not library.handlers:
        library.addHandler(logging.NullHandler())


if "logging" in sys.modules:
    _silence()
