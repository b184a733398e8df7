from __future__ import annotations

from pathlib import Path

import pytest

from tickrig.emulators.testing.campaign.order import CampaignRefusal
from tickrig.emulators.testing.campaign.table import (
    CampaignRow,
    CampaignTable,
    merge_tables,
    missing_seeds,
    read_table,
    summary,
    write_table,
)

ROWS = [
    CampaignRow("t.py::test_a[flip=0.1]", 2, ("0.1",), "passed", 1_000, "", "", ""),
    CampaignRow(
        "t.py::test_a[flip=0.1]", 10, ("0.1",), "failed", 7, "t.py:3", 'said "no", µ', "pytest x"
    ),
    CampaignRow("t.py::test_b", 2, ("",), "skipped", 0, "", "not virtual", ""),
]
TABLE = CampaignTable(("flip",), ROWS)


@pytest.mark.parametrize("suffix", [".csv", ".parquet"])
def test_what_was_written_is_read_back(tmp_path: Path, suffix: str) -> None:
    if suffix == ".parquet":
        pytest.importorskip("pyarrow")
    path = tmp_path / f"t{suffix}"
    for table in (TABLE, CampaignTable((), [])):
        write_table(table, path)
        assert read_table(path) == table


def test_csv_is_as_everybody_reads_it(tmp_path: Path) -> None:
    write_table(TABLE, tmp_path / "t.csv")
    assert (tmp_path / "t.csv").read_text("utf-8") == (
        "test,seed,flip,outcome,virtual_us,where,reason,replay\n"
        "t.py::test_a[flip=0.1],2,0.1,passed,1000,,,\n"
        't.py::test_a[flip=0.1],10,0.1,failed,7,t.py:3,"said ""no"", µ",pytest x\n'
        "t.py::test_b,2,,skipped,0,,not virtual,\n"
    )


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("", "is no table of a campaign: its columns are "),
        ("a,b\n1,2\n", "is no table of a campaign: its columns are a, b"),
        ("\xff", "is no table of a campaign: 'utf-8'"),
        ("HEAD\nt.py::test_a,2\n", ":2: no row of a campaign: t.py::test_a,2"),
        ("HEAD\nt,x,,passed,0,,,\n", ":2: no row of a campaign: t,x,,passed,0,,,"),
    ],
)
def test_what_is_no_table_is_told(tmp_path: Path, text: str, said: str) -> None:
    head = "test,seed,flip,outcome,virtual_us,where,reason,replay"
    (tmp_path / "t.csv").write_bytes(text.replace("HEAD", head).encode("latin-1"))
    with pytest.raises(CampaignRefusal) as refusal:
        read_table(tmp_path / "t.csv")
    assert said in str(refusal.value)


def test_shards_are_joined_in_any_order() -> None:
    parts = [
        (Path(name), CampaignTable(("flip",), [row])) for name, row in zip("cab", ROWS, strict=True)
    ]
    assert merge_tables(parts) == merge_tables([*parts[::-1], *parts]) == TABLE


def test_what_does_not_fit_together_is_told() -> None:
    other = TABLE._replace(rows=[ROWS[0]._replace(outcome="failed")])
    with pytest.raises(
        CampaignRefusal, match=r"with seed 2 is not the same in two tables: passed in"
    ):
        merge_tables([(Path("a"), TABLE), (Path("b"), other)])
    with pytest.raises(CampaignRefusal, match=r"b has the parameters none; a has flip"):
        merge_tables([(Path("a"), TABLE), (Path("b"), CampaignTable((), ()))])


def test_a_shard_that_was_forgotten_is_told() -> None:
    assert list(missing_seeds(TABLE)) == [
        "t.py::test_a[flip=0.1]: 7 of the seeds 2-10 are missing: is a shard?"
    ]


def test_a_summary_has_each_way_to_fail_and_its_commands() -> None:
    failed = [
        ROWS[1]._replace(seed=seed, reason=f"{seed} is too many" * 20, replay=f"pytest {seed}")
        for seed in (*range(20, 30), 50, 52)
    ]
    lines = list(summary(TABLE._replace(rows=[*ROWS, *failed]), "t.csv"))
    assert lines[:5] == [
        "t.csv: 15 runs, 1 passed, 13 failed, 1 skipped",
        "",
        "t.py::test_a[flip=0.1]: 13 of 14 failed",
        '  t.py:3: said "no", µ',
        "  seeds 10,20-29,50,52 (13)",
    ]
    assert lines[5:7] == ["  pytest x", "  pytest 20"]
    assert lines[14:] == ["  pytest 28", "  ... and 3 more in the column replay"]


def test_values_of_parameters_are_in_the_order_of_numbers() -> None:
    rates = ("0.003", "0.02", "0.1", "2", "10")
    rows = [CampaignRow(f"t.py::test_a[flip={r}]", 1, (r,), "passed", 1, "", "", "") for r in rates]
    parts = [(Path(row.values[0]), CampaignTable(("flip",), [row])) for row in reversed(rows)]
    assert [row.values[0] for row in merge_tables(parts).rows] == list(rates)
