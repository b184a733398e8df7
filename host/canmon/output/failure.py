"""A bus or a file that fails while it is used."""

from __future__ import annotations

import click


class SourceFailed(click.ClickException):
    """One line on standard error, and exit status 3."""

    exit_code = 3
