"""Our own files pass; other tools read what we mend."""

from __future__ import annotations

from pathlib import Path
from typing import Final

import pytest
from canopen.objectdictionary import import_od

from tests.host.canopen.data_sheet.corpus import CORPUS, NAME, ROOT, Deviation
from tickrig.emulators.canopen.models import MODELS
from tickrig.host.canopen.data_sheet.check import check, failing
from tickrig.host.canopen.data_sheet.document import Document
from tickrig.host.canopen.data_sheet.fix import fix
from tickrig.wire.canopen.eds.eds_writer import write_dcf, write_eds

OWN: Final = [
    *sorted((ROOT / "examples").rglob("*.eds")),
    *sorted((ROOT / "tests" / "golden").rglob("*.eds")),
]
MENDED: Final = [each for each in CORPUS if each.mended and each.rule != "compact-record"]


@pytest.mark.parametrize("path", OWN, ids=[path.stem for path in OWN])
def test_our_files_pass_with_strict(path: Path) -> None:
    found = check(Document(str(path), path.read_bytes()))
    assert [str(one) for one in failing(found, strict=True)] == []


@pytest.mark.parametrize("name", MODELS)
def test_what_our_writer_writes_passes_with_strict(name: str) -> None:
    model = MODELS[name].describe()
    table = model.template.description
    for file, text in (
        ("a.eds", write_eds(table, model.info)),
        ("a.dcf", write_dcf(table, 5, 125_000, {}, model.info)),
    ):
        found = check(Document(file, text.encode()))
        assert [str(one) for one in failing(found, strict=True)] == []


@pytest.mark.parametrize("at", range(0, len(MENDED), 4))
def test_the_canopen_library_reads_what_is_mended(at: int, tmp_path: Path) -> None:
    deviation: Deviation = MENDED[at]
    path = tmp_path / NAME
    path.write_bytes(fix(Document(NAME, deviation.data)).document.data)
    document = Document(NAME, path.read_bytes())
    found = import_od(str(path), 5)
    described = {index for _, index, _ in document.file.objects()}
    assert described <= set(found)
    for (index, sub), row in document.rows.items():
        if index not in described:  # CompactPDO implies it, which canopen does not know
            continue
        variable = found.get_variable(index, sub)
        assert variable is not None
        assert variable.data_type == row.data_type
