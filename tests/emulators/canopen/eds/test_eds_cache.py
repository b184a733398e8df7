from __future__ import annotations

import os
from pathlib import Path

import pytest

from tickrig.emulators.canopen.eds import EdsCache
from tickrig.wire.canopen.eds.eds_file import EdsError

TYPE = "[1000]\nParameterName=Device type\nDataType=7\nAccessType=ro\n"


def write(path: Path, text: str, time_ns: int) -> None:
    path.write_text(text)
    os.utime(path, ns=(time_ns, time_ns))


def test_a_file_is_read_once_until_it_changes(tmp_path: Path) -> None:
    cache, path = EdsCache(), tmp_path / "a.eds"
    write(path, "[DeviceInfo]\nVendorName=A\n" + TYPE, 1_000_000_000)
    first = cache.read(path)
    assert cache.read(path) is first
    write(path, "[DeviceInfo]\nVendorName=B\n" + TYPE, 2_000_000_000)
    assert cache.read(path).info.vendor_name == "B"


def test_a_file_that_cannot_be_read_is_no_secret(tmp_path: Path) -> None:
    cache, path = EdsCache(), tmp_path / "a.eds"
    with pytest.raises(FileNotFoundError):
        cache.read(path)
    path.write_text("nothing")
    with pytest.raises(EdsError, match=r"a\.eds: has no objects"):
        cache.read(path)
