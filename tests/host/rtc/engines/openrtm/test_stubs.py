"""Stubs are compiled once, whoever else does so at the same time, and wherever that can be."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tickrig.host.rtc.engines.openrtm.stubs import IDL, compile_idl
from tickrig.host.rtc.states import RtcRefused

WHERE = """
from tickrig.host.rtc.engines.openrtm.stubs import stubs
print(stubs().rtc.PortService._NP_RepositoryId, stubs().services.RefHard)
import sys
print(sys.modules["tickrig_openrtm"].__path__[0])
"""
HIDDEN = """
import sys
sys.modules["omniORB"] = None
from tickrig.host.rtc.engines.openrtm.stubs import stubs
try:
    stubs()
except ValueError as error:
    print(error)
"""


def begin(code: str, cache: Path, **variables: str) -> subprocess.Popen[str]:
    variables = {**os.environ, "XDG_CACHE_HOME": str(cache), **variables}
    command = [sys.executable, "-c", code]
    pipe = subprocess.PIPE
    return subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True, env=variables)


def folder_of(process: subprocess.Popen[str]) -> Path:
    out, errors = process.communicate(timeout=60)
    assert errors == ""
    first, second = out.splitlines()
    assert first.startswith("IDL:omg.org/RTC/PortService:1.0 <class 'tickrig_openrtm._Global")
    return Path(second).parent


def test_without_omniorb_it_is_said_what_to_install(tmp_path: Path) -> None:
    out, _ = begin(HIDDEN, tmp_path).communicate(timeout=60)
    assert out == "OpenRTM needs omniORB: pip install 'tickrig[openrtm]'\n"


@OMNIORB
def test_two_processes_at_once_make_one_cache(tmp_path: Path) -> None:
    processes = [begin(WHERE, tmp_path) for _ in range(2)]
    folders = {folder_of(process) for process in processes}
    assert folders == set((tmp_path / "tickrig").iterdir())


@OMNIORB
def test_the_cache_is_used_again_and_made_again_if_it_was_damaged(tmp_path: Path) -> None:
    folder = folder_of(begin(WHERE, tmp_path))
    mark = folder / "mark"
    mark.touch()
    assert folder_of(begin(WHERE, tmp_path)) == folder
    assert mark.exists()
    (folder / "tickrig_openrtm" / "RTC_idl.py").write_text("raise SystemError")
    assert folder_of(begin(WHERE, tmp_path)) == folder
    assert not mark.exists()


@OMNIORB
@pytest.mark.parametrize("home", ["", "/dev/null"])
def test_where_no_cache_can_be_the_stubs_end_with_the_process(tmp_path: Path, home: str) -> None:
    (tmp_path / "file").touch()
    temporary = tmp_path / "tmp"
    temporary.mkdir()
    process = begin(WHERE, tmp_path / "file", TMPDIR=str(temporary), HOME=home)
    assert folder_of(process).parent == temporary
    assert list(temporary.iterdir()) == []


@OMNIORB
def test_a_mistake_in_idl_is_said_in_a_line(tmp_path: Path) -> None:
    wrong = tmp_path / "wrong.idl"
    wrong.write_text('#include "RTC.idl"\ninterface { };\n')
    with pytest.raises(RtcRefused, match=r"omniidl: .*wrong\.idl:2: ") as error:
        compile_idl([wrong], tmp_path)
    assert "\n" not in str(error.value)


@OMNIORB
def test_idl_files_stand_by_themselves(tmp_path: Path) -> None:
    for path in IDL.glob("*.idl"):
        compile_idl([path], tmp_path, "alone")
