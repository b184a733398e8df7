"""Whatever a file is: findings in lines, never a traceback; tools/fuzz eds does more."""

from __future__ import annotations

import re
import subprocess
import sys
from random import Random

import pytest

from tests.host.canopen.data_sheet.corpus import ROOT
from tests.host.canopen.data_sheet.mutations import LISTS, SMALL, judge, mutated
from tests.wire.canopen.eds.xdd_text import XDD
from tickrig.host.canopen.data_sheet.check import check
from tickrig.host.canopen.data_sheet.document import Document


@pytest.mark.parametrize("seed", range(10))
def test_a_mutated_eds_is_judged_read_and_mended(seed: int) -> None:
    chance = Random(seed)
    for _ in range(25):
        judge(*mutated(chance))


def test_the_files_of_a_seed_are_judged_alike_by_several_processes() -> None:
    told = []
    for jobs in ("1", "2"):
        words = [sys.executable, str(ROOT / "tools" / "fuzz"), "eds", "--files", "120", "-j", jobs]
        said = subprocess.run(words, capture_output=True, text=True, check=True).stdout
        told.append(said.partition(";")[0])
    assert told[0] == told[1]
    assert told[0].startswith("seed 1: 120 files, {")


def test_a_compact_object_with_a_name_that_cannot_be_written_is_judged() -> None:
    assert judge("a.eds", SMALL.replace("=map\n", "=m\x18ap\n").encode()) == "left"


def test_a_byte_without_a_letter_is_not_written_into_another_section() -> None:
    data = (
        SMALL.encode()
        .replace(b"=map\n", b"=m\x81ap\n")
        .replace(b"HighLimit=5", b"HighLimit=5UL\x81")
    )
    assert judge("a.eds", data) == "left"


def test_a_last_section_that_cannot_be_printed_is_told() -> None:
    data = f"{LISTS[0]}[1018\x1asub1]\nParameterName=vendor\n".encode()
    assert "ends in [1018?sub1]" in str(check(Document("a.eds", data)))
    judge("a.eds", data)


def test_a_section_of_xml_that_cannot_be_printed_is_told() -> None:
    assert judge("a.eds", XDD.replace('index="2002"', 'index="\xadE2002"').encode()) == "refused"


def test_noise_is_no_eds() -> None:
    chance = Random(0)
    for size in (0, 1, 2, 3, 10, 1_000, 20_000):
        assert judge("a.eds", chance.randbytes(size)) == "refused"


@pytest.mark.parametrize(
    "key", ["NrOfRXPDO", "SubNumber", "DefaultValue", "LowLimit", "1", "Lines"]
)
@pytest.mark.parametrize("digits", ["0x" + "F" * 5_000, "9" * 5_000, "0" + "7" * 5_000])
def test_a_number_of_5000_digits_is_told_in_a_line(key: str, digits: str) -> None:
    text = re.sub(rf"^{key}=.*$", f"{key}={digits}", SMALL, count=1, flags=re.MULTILINE)
    assert digits in text
    judge("a.eds", text.encode())
    judge("a.eds", SMALL.replace("\n1=0x1000", f"\n{digits}=0x1000").encode())
