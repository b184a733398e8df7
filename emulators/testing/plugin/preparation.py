"""What is done before the first test, if anything was asked for."""

from __future__ import annotations

from importlib.util import find_spec

import pytest

from tickrig.emulators.testing.plugin.settings import Settings


def prepare(config: pytest.Config, settings: Settings) -> None:
    """Look at the rig file, and register what a run asks for.

    Raises:
        pytest.UsageError: the rig file cannot be used, or what was asked for does not fit together.
    """
    if settings.rig_file and settings.ordered:
        from tickrig.emulators.testing.plugin.bench_source import plan_of  # noqa: PLC0415 - slow

        try:
            plan_of(settings.rig_file)
        except OSError as error:
            raise pytest.UsageError(f"{settings.rig_file}: {error.strerror}") from None
        except ValueError as error:
            raise pytest.UsageError(str(error)) from None
    if settings.compare:
        from tickrig.emulators.testing.plugin.compare import Compare  # noqa: PLC0415 - asked for

        if settings.modes != ("virtual",):
            raise pytest.UsageError("--bench-compare compares runs in virtual time only")
        config.pluginmanager.register(Compare(), "tickrig-bench-compare")
    if settings.report:
        if settings.report.suffix != ".json" and find_spec("jinja2") is None:
            raise pytest.UsageError("--bench-report needs Jinja2: pip install 'tickrig[report]'")
        from tickrig.emulators.testing.plugin.report_plugin import (  # noqa: PLC0415 - asked for
            ReportPlugin,
        )

        config.pluginmanager.register(ReportPlugin(config, settings), "tickrig-bench-report")
