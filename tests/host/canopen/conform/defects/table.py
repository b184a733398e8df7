"""All defects."""

from __future__ import annotations

from typing import Final

from tests.host.canopen.conform.defects import (
    of_blocks,
    of_clauses,
    of_error_control,
    of_nmt,
    of_others,
    of_pdo,
    of_profiles,
    of_sdo,
    of_services,
)
from tests.host.canopen.conform.defects.defect import Defect

DEFECTS: Final[tuple[Defect, ...]] = (
    *of_nmt.DEFECTS,
    *of_error_control.DEFECTS,
    *of_sdo.DEFECTS,
    *of_blocks.DEFECTS,
    *of_pdo.DEFECTS,
    *of_services.DEFECTS,
    *of_profiles.DEFECTS,
    *of_clauses.DEFECTS,
    *of_others.DEFECTS,
)
