from __future__ import annotations

from pathlib import Path

import pytest

from tickrig.emulators.testing.report.bench_report import Requirement
from tickrig.emulators.testing.report.overview import parse_requirements, read_requirements


def test_a_line_is_a_name_and_what_it_demands() -> None:
    text = "\ufeffSAF-1\t It stops  \n\n  # not yet: SAF-3\nSAF-2\n#\n"
    assert parse_requirements(text, "saf.txt") == (
        Requirement("SAF-1", "It stops"),
        Requirement("SAF-2"),
    )


@pytest.mark.parametrize(
    ("text", "error"),
    [
        ("", "saf.txt: no requirement: write one a line, as SAF-12 It stops"),
        (
            "A\n\nB\nA x\nB\nA\n",
            "saf.txt:4: A stands in line 1 already\n"
            "saf.txt:5: B stands in line 3 already\nsaf.txt:6: A stands in line 1 already",
        ),
    ],
)
def test_all_that_is_wrong_is_told(text: str, error: str) -> None:
    with pytest.raises(ValueError, match=r"^saf\.txt:") as refused:
        parse_requirements(text, "saf.txt")
    assert str(refused.value) == error


def test_a_file_that_is_no_text_is_told(tmp_path: Path) -> None:
    path = tmp_path / "saf.txt"
    path.write_bytes(b"A \xc3\xa4\n")
    assert read_requirements(path) == (Requirement("A", "ä"),)
    path.write_bytes(b"A\n\xff")
    with pytest.raises(ValueError, match=r"saf\.txt: not UTF-8 at byte 2$"):
        read_requirements(path)
