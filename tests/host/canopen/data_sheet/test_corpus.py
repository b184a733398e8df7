"""Each deviation of real files is reported, read for what it is, and mended where that can be."""

from __future__ import annotations

import re
from typing import Final

import pytest

from tests.host.canopen.data_sheet.corpus import (
    CORPUS,
    DRIVE,
    GOOD,
    NAME,
    Deviation,
    counted_only,
    within,
)
from tickrig.host.canopen.data_sheet.check import check, failing
from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.fix import fix
from tickrig.host.canopen.data_sheet.rule import RULES, Severity
from tickrig.host.canopen.data_sheet.show import diff, pdos
from tickrig.wire.canopen.eds.object_table import EntryDescription

FIELDS: Final = [name for name in EntryDescription.__slots__ if name != "key"]
IDS: Final = [f"{at}-{each.rule}" for at, each in enumerate(CORPUS)]
all_deviations = pytest.mark.parametrize("deviation", CORPUS, ids=IDS)


def document_of(deviation: Deviation) -> Document:
    return Document(deviation.name, deviation.data)


def rows(document: Document) -> dict[tuple[int, int], list[object]]:
    return {key: [getattr(row, name) for name in FIELDS] for key, row in document.rows.items()}


def rules(document: Document) -> set[str]:
    return {one.rule.name for one in check(document)}


@pytest.mark.parametrize(
    ("text", "name"), [(GOOD, NAME), (DRIVE, "epos.eds"), (counted_only(GOOD), NAME)]
)
def test_what_is_deviated_from_is_without_any_finding(text: str, name: str) -> None:
    assert check(Document(name, text.encode())) == []


def test_pdos_that_are_only_counted_are_compared_and_shown() -> None:
    described, counted = (Document(NAME, text.encode()) for text in (GOOD, counted_only(GOOD)))
    changed = {(one.place[:5], one.what) for one in diff(described, counted)}
    assert "object" not in {what for _, what in changed}
    assert {place for place, _ in changed} == {"1403h", "1603h", "1803h", "1A03h"}
    assert [pdo["can_id"] for pdo in pdos(counted, 5)] == [
        pdo["can_id"] for pdo in pdos(described, 5)
    ]
    assert fix(counted).document.data == counted.data


def test_every_rule_has_a_deviation() -> None:
    assert {each.rule for each in CORPUS} == RULES.keys()


@all_deviations
def test_a_deviation_is_reported(deviation: Deviation) -> None:
    document = document_of(deviation)
    found = [one for one in check(document) if one.rule.name == deviation.rule]
    assert found
    lines = max(len(document.texts), 1)
    for one in found:
        assert 0 <= one.line <= lines
        assert "\n" not in str(one)


@pytest.mark.parametrize(
    ("section", "line", "other", "rule"),
    [
        ("1017", "DataType=0x0006\n", "", "data-type-missing"),
        ("1017", "DataType=0x0006\n", "DataType=\n", "empty-value"),
        ("1017", "DataType=0x0006\n", "DataType=abc\n", "no-number"),
        ("1017", "DataType=0x0006\n", "DataType=0x00FF\n", "data-type-unknown"),
        ("1000", "AccessType=ro\n", "", "access-missing"),
        ("1000", "AccessType=ro\n", "AccessType=abc\n", "access-form"),
    ],
)
def test_what_the_reader_has_guessed_breaks_no_other_rule(
    section: str, line: str, other: str, rule: str
) -> None:
    changed = within(section, line, other)(GOOD)
    assert rules(Document(NAME, changed.encode())) == {rule}


@all_deviations
def test_a_deviation_is_read_for_what_it_is(deviation: Deviation) -> None:
    document = document_of(deviation)
    if deviation.reads is None:
        assert rows(document) == rows(Document(NAME, GOOD.encode()))
    else:
        assert deviation.reads(document)


@all_deviations
def test_what_is_mended_passes_and_the_rest_is_told(deviation: Deviation) -> None:
    fixed = fix(document_of(deviation))
    if deviation.mended:
        assert [str(one) for one in fixed.left] == []
    elif RULES[deviation.rule].severity is not Severity.NOTE:
        assert fixed.left
    assert list(fixed.left) == failing(check(fixed.document), strict=True)
    text = fixed.document.data.decode("utf-8", "replace")
    assert [kept for kept in deviation.keeps if kept not in text] == []
    if deviation.rule == "truncated":
        assert (fixed.mended, fixed.document.data) == ((), deviation.data)


@all_deviations
def test_mending_changes_nothing_else(deviation: Deviation) -> None:
    document = document_of(deviation)
    fixed = fix(document)
    again = fix(fixed.document)
    assert (again.mended, again.document.data) == ((), fixed.document.data)
    if not fixed.mended:
        assert fixed.document.data == document.data
    told = {one.rule.name for one in fixed.mended}
    if not told & {"sub0-value"}:
        assert rows(fixed.document) == rows(document) or told & CHARACTERS


CHARACTERS: Final = {"control-character"}
"""What a reader sees of these is not what is left when they are mended."""


def test_lines_that_no_finding_names_stay_to_the_byte() -> None:
    made = GOOD.replace("u8 write", "µ8 write").replace("NrOfRXPDO=4", "NrOfRXPDO = 7 ")
    data = made.replace("\n", "\r\n").encode()
    fixed = fix(Document(NAME, data))
    assert fixed.document.data == data.replace(b"NrOfRXPDO = 7 ", b"NrOfRXPDO = 4 ")
    assert [(one.rule.name, one.line) for one in fixed.mended] == [("pdo-count", 29)]


@pytest.mark.parametrize("page", ["cp1252", "cp850"])
def test_what_is_not_utf_8_becomes_utf_8_and_its_letter_is_told(page: str) -> None:
    made = GOOD.replace("u8 write", "größer als 5 °C")
    fixed = fix(Document(NAME, made.encode(page)))
    assert fixed.document.data.decode() == made
    ((rule, text),) = [(one.rule.name, one.text) for one in fixed.mended]
    assert rule == "not-utf-8"
    byte = "ö".encode(page).hex().upper()
    assert text.startswith(
        f"not UTF-8, which the canopen library and dcf-tools need; byte {byte}h is 'ö' in {page}, "
    )


def test_a_comment_behind_a_number_is_one_finding() -> None:
    numbers = re.findall(
        r"^(?:Dummy000\w|Lines|Granularity|NrOf.XPDO|SupportedObjects|1)=.*", GOOD, re.MULTILINE
    )
    for line in numbers:
        made = Document(NAME, GOOD.replace(f"{line}\n", f"{line} # one\n").encode())
        assert rules(made) <= {"inline-comment"}, line


def test_the_encoding_that_is_named_is_that_of_the_file() -> None:
    data = GOOD.replace("u8 write", "5 °C").encode("cp850")
    assert "5 °C" in fix(Document(NAME, data, "cp850")).document.data.decode()
    assert "5 ø" in fix(Document(NAME, data)).document.data.decode()


def test_a_byte_that_no_code_page_has_is_no_letter_of_another() -> None:
    data = GOOD.replace("u8 write", "\x81 write").encode("latin-1")
    fixed = fix(Document(NAME, data))
    assert fixed.document.data.decode() == GOOD.replace("u8 write", "\ufffd write")
    assert "byte 81h is '\ufffd' in cp1252, 'ü' in cp850" in fixed.mended[0].text


def test_letters_may_be_written_in_ascii() -> None:
    made = GOOD.replace("u8 write", "größer als 5 °C, ✓")
    fixed = fix(Document(NAME, made.encode("cp1252", "replace")), ascii_only=True)
    assert fixed.document.data == GOOD.replace("u8 write", "groesser als 5 degC, ?").encode()
    told = [one.text for one in fixed.mended if one.rule.name == "non-ascii"]
    assert told == ["letters beyond ASCII are written: 'ö' as 'oe', 'ß' as 'ss', '°' as 'deg'"]
