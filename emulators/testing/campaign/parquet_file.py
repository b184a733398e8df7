"""Tables as Parquet, by pyarrow (extra `campaign`)."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from io import BytesIO
from pathlib import Path
from typing import Final

import pyarrow
from pyarrow import parquet

from tickrig.emulators.testing.campaign.order import CampaignRefusal

_NUMBERS: Final = ("seed", "virtual_us")


def parquet_of(names: Sequence[str], rows: Sequence[Sequence[str | int]]) -> bytes:
    """Return the bytes of the file; all columns except two are texts."""
    types = [(name, pyarrow.int64() if name in _NUMBERS else pyarrow.string()) for name in names]
    columns = [
        pyarrow.array([cells[at] for cells in rows], kind) for at, (_, kind) in enumerate(types)
    ]
    stream = BytesIO()
    parquet.write_table(pyarrow.table(columns, pyarrow.schema(types)), stream)
    return stream.getvalue()


def read_parquet(path: Path) -> Iterator[Sequence[str]]:
    """Read a Parquet file: yield the names of its columns, then each row as a sequence of texts.

    Raises:
        Refusal: the file is not a Parquet file.
        OSError: the file cannot be read.
    """
    data = path.read_bytes()
    try:
        table = parquet.read_table(BytesIO(data))
    except pyarrow.ArrowException as error:
        raise CampaignRefusal(
            f"{path} is no table of a campaign: {str(error).splitlines()[0]}"
        ) from None
    yield table.column_names
    for row in zip(*(column.to_pylist() for column in table.columns), strict=True):
        yield [str(cell) for cell in row]
