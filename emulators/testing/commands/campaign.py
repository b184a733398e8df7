"""The work of `tickrig campaign`: runs and their table; tables of shards joined."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Final

import click

from tickrig.emulators.testing.campaign.campaign_run import (
    CampaignOptions,
    CampaignRun,
    check_arrow,
    check_outputs,
    write_outputs,
)
from tickrig.emulators.testing.campaign.order import CampaignRefusal
from tickrig.emulators.testing.campaign.table import (
    WELL,
    CampaignTable,
    merge_tables,
    missing_seeds,
    read_table,
    summary,
)
from tickrig.host.cli.messages import Refused, say
from tickrig.host.cli.options import VERSION

_NOT_PASSED: Final = 1


def run(**options: Any) -> int:
    """Do the runs; return the exit status."""
    try:
        wanted = CampaignOptions(version=VERSION, **options)
        table = CampaignRun(wanted).run()
    except CampaignRefusal as refusal:
        raise Refused(str(refusal)) from None
    return _shown(table, wanted.output_paths[0])


def merge(tables: tuple[Path, ...], outputs: tuple[Path, ...]) -> int:
    """Join the tables; return the exit status."""
    try:
        check_outputs(outputs)
        check_arrow(tables)
        table = merge_tables([(path, read_table(path)) for path in tables])
        write_outputs(table, outputs)
    except CampaignRefusal as refusal:
        raise Refused(str(refusal)) from None
    except OSError as error:
        raise Refused(f"{error.filename}: {error.strerror}") from None
    for line in missing_seeds(table):
        say(f"warning: {line}")
    return _shown(table, outputs[0])


def _shown(table: CampaignTable, path: Path) -> int:
    for line in summary(table, str(path)):
        click.echo(line)
    return 0 if all(row.outcome in WELL for row in table.rows) else _NOT_PASSED
