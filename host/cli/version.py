"""The option `--version`."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import click

from tickrig import __version__


def version_option() -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return a decorator that adds `--version`, in the form that all commands have."""
    return click.version_option(__version__, message="%(prog)s (tickrig) %(version)s")
