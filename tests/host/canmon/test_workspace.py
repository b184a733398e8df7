from __future__ import annotations

import stat
import sys
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from tickrig.host.canmon.workspace import SettingError, Workspace, WorkspaceError

TEXT = """\
# our bench
[bus]
source = ["can0"]   # the blue cable
colour = "blue"

[transmit]
[[transmit.frames]]
frame = "185#00"    # controlword
note = "mine"

[[transmit.frames]]
frame = "186#00"
"""

values = st.recursive(
    st.booleans() | st.integers(-(2**63), 2**63 - 1) | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(), inner, max_size=3),
    max_leaves=6,
)


@pytest.fixture
def path(tmp_path: Path) -> Path:
    path = tmp_path / "bench.toml"
    path.write_text(TEXT, "utf-8")
    return path


def test_what_nobody_knows_stays_with_comments_and_order(path: Path) -> None:
    workspace = Workspace.read(path)
    workspace.put("bus", {"source": ["can1"]})
    workspace.put("transmit", {"frames": [{"frame": "185#01"}, {"frame": "186#00"}]})
    assert workspace.write()
    expected = TEXT.replace('"can0"', '"can1"').replace("185#00", "185#01")
    assert path.read_text("utf-8") == expected


def test_nothing_is_written_while_nothing_changes(path: Path) -> None:
    workspace = Workspace.read(path)
    path.chmod(0o444)
    workspace.put("bus", {"source": ["can0"]})
    workspace.put("trace", {})
    assert not workspace.write()
    assert workspace.sections() == ["bus", "transmit"]


def test_rows_come_and_go(path: Path) -> None:
    workspace = Workspace.read(path)
    for rows in ([{"frame": "1"}], [{"frame": "1"}, {"frame": "2"}, {"frame": "3"}], []):
        workspace.put("transmit", {"frames": rows})
        workspace.write()
        read = Workspace.read(path).section("transmit")["frames"]
        assert [row["frame"] for row in read] == [row["frame"] for row in rows]


@given(st.dictionaries(st.text(min_size=1), values, min_size=1, max_size=4))
def test_settings_come_back_as_they_were(settings: dict[str, Any]) -> None:
    workspace = Workspace(TEXT)
    workspace.put("panel", settings)
    again = Workspace(workspace.text)
    assert again.section("panel") == settings
    again.put("panel", settings)
    assert again.text == workspace.text


def test_a_file_that_is_not_there_is_made_whole(tmp_path: Path) -> None:
    path = tmp_path / "new.toml"
    workspace = Workspace.read(path)
    workspace.put("trace", {"bits": True})
    assert workspace.write()
    assert path.read_text("utf-8") == "[trace]\nbits = true\n"
    assert [file.name for file in tmp_path.iterdir()] == ["new.toml"]


def test_a_link_and_the_mode_of_a_file_stay(path: Path, tmp_path: Path) -> None:
    path.chmod(0o600)
    link = tmp_path / "link.toml"
    link.symlink_to(path)
    workspace = Workspace.read(link)
    workspace.put("trace", {"bits": True})
    assert workspace.write()
    assert link.is_symlink()
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert "bits = true" in path.read_text("utf-8")


def test_a_file_that_somebody_else_changed_is_left_alone(path: Path) -> None:
    workspace = Workspace.read(path)
    path.write_text("[bus]\n", "utf-8")
    workspace.put("trace", {"bits": True})
    with pytest.raises(WorkspaceError, match=r"bench\.toml was changed by another program: not"):
        workspace.write()
    assert path.read_text("utf-8") == "[bus]\n"
    assert workspace.write(over=True)
    assert "bits = true" in path.read_text("utf-8")


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[bus]\nsource = \n", r"line 2: Unexpected character: '\\n'"),
        ("[bus\n", "line 1: "),
        ("a = 1\na = 2\n", r'line 2: Key "a" already exists\.'),
    ],
)
def test_a_broken_file_is_told_with_its_line_and_left_alone(
    path: Path, text: str, reason: str
) -> None:
    path.write_text(text, "utf-8")
    with pytest.raises(WorkspaceError, match=reason):
        Workspace.read(path)
    assert path.read_text("utf-8") == text


def test_a_setting_is_told_with_its_line(path: Path) -> None:
    workspace = Workspace.read(path)
    error = SettingError(("frames", 1, "frame"), "'186#00' is none")
    told = workspace.wrong(error, "transmit")
    assert str(told) == f"{path}, line 12: transmit.frames.1.frame: '186#00' is none"


def test_a_section_that_is_no_table_is_told(path: Path) -> None:
    path.write_text("\ntrace = 3\n", "utf-8")
    with pytest.raises(WorkspaceError, match="line 2: trace: is no table"):
        Workspace.read(path).section("trace")


def test_what_cannot_be_read_or_written_is_told(tmp_path: Path) -> None:
    with pytest.raises(WorkspaceError, match="Is a directory"):
        Workspace.read(tmp_path)
    noise = tmp_path / "noise"
    noise.write_bytes(b"\xff\xfe\x00")
    with pytest.raises(WorkspaceError, match="noise is no text"):
        Workspace.read(noise)
    workspace = Workspace("", tmp_path / "no" / "bench.toml")
    workspace.put("trace", {"bits": True})
    with pytest.raises(WorkspaceError, match="No such file or directory: not saved"):
        workspace.write()


def test_a_write_that_fails_leaves_the_file_and_nothing_beside_it(
    path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("os.fsync", full)
    workspace = Workspace.read(path)
    workspace.put("trace", {"bits": True})
    with pytest.raises(WorkspaceError, match="No space left on device: not saved"):
        workspace.write()
    assert path.read_text("utf-8") == TEXT
    assert list(path.parent.iterdir()) == [path]


def test_without_tomlkit_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "tomlkit", None)
    with pytest.raises(WorkspaceError, match=r"pip install 'tickrig\[tui\]'"):
        Workspace()
