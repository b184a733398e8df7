"""What is done before the first test, if anything was asked for."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from tickrig.emulators.testing.plugin.settings import MODES, Settings


def prepare(config: pytest.Config, settings: Settings) -> None:
    """Look at the rig file, and register what a run asks for.

    Raises:
        pytest.UsageError: the rig file cannot be used, or what was asked for does not fit together.
    """
    if settings.rig_file and settings.ordered:
        from tickrig.emulators.testing.plugin.bench_source import plan_of  # noqa: PLC0415 - slow

        with _usage():
            plan_of(settings.rig_file)
    if settings.compare:
        from tickrig.emulators.testing.plugin.compare import Compare  # noqa: PLC0415 - asked for

        if MODES[0] not in settings.modes:
            raise pytest.UsageError("--bench-compare compares runs in virtual time only")
        config.pluginmanager.register(Compare(), "tickrig-bench-compare")
    if settings.parameters:
        from tickrig.emulators.testing.plugin.parameters import Parameters  # noqa: PLC0415 - asked

        config.pluginmanager.register(Parameters(settings.parameters), "tickrig-bench-param")
    if settings.artifacts:
        from tickrig.host.text.whole_file import check_writable  # noqa: PLC0415 - asked for

        try:
            check_writable(settings.artifacts)
        except OSError as error:
            where = f"--bench-artifacts {settings.artifacts}"
            raise pytest.UsageError(f"{where}: {error.strerror}") from None
    if settings.report:
        from tickrig.emulators.testing.plugin.report_plugin import (  # noqa: PLC0415 - asked for
            ReportPlugin,
        )
        from tickrig.emulators.testing.report.report_file import check_report  # noqa: PLC0415

        with _usage():
            check_report(settings.report)
            plugin = ReportPlugin(config, settings)
        config.pluginmanager.register(plugin, "tickrig-bench-report")


@contextmanager
def _usage() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise pytest.UsageError(f"{error.filename}: {error.strerror}") from None
    except ValueError as error:
        raise pytest.UsageError(str(error)) from None
