"""Have click's CliRunner keep standard output and error apart with click 8.1, as 8.2 does."""

from __future__ import annotations

import inspect
from typing import Any

import click.testing

if "mix_stderr" in inspect.signature(click.testing.CliRunner).parameters:  # click before 8.2

    class SplitResult(click.testing.Result):
        """What was written to both streams, and to each."""

        @property
        def stdout(self) -> str:
            return self.stdout_bytes.decode(errors="replace").replace("\r\n", "\n")

        @property
        def output(self) -> str:
            return self.stdout + self.stderr

    class SplitRunner(click.testing.CliRunner):
        """Keeps the streams apart, as click 8.2 and later do."""

        def __init__(self, **options: Any) -> None:
            options["mix_stderr"] = False
            super().__init__(**options)

        def invoke(self, *args: Any, **options: Any) -> click.testing.Result:
            result = super().invoke(*args, **options)
            result.__class__ = SplitResult
            return result

    click.testing.CliRunner = SplitRunner  # type: ignore[misc, assignment]
