from __future__ import annotations

import os
from pathlib import Path

import pytest

from tests.device.canopen.reference import make_dictionary
from tickrig.device.canopen.slave import Nonvolatile
from tickrig.emulators.canopen.store_file import StoreError, StoreFile

HEARTBEAT = 0x1017 << 8
NAME = 0x2007 << 8


def test_what_a_node_stored_is_there_the_next_time(tmp_path: Path) -> None:
    store = StoreFile(tmp_path / "store.json")
    memory = store.nonvolatile("5", make_dictionary())
    assert memory == Nonvolatile()
    memory.parameters = {HEARTBEAT: b"\x64\x00", NAME: b""}
    memory.node_id, memory.bit_rate_index = 16, 2
    memory.changed()
    assert store.save()
    again = StoreFile(tmp_path / "store.json").nonvolatile("5", make_dictionary())
    assert again.parameters == memory.parameters
    assert (again.node_id, again.bit_rate_index) == (16, 2)


def test_nothing_is_written_before_something_is_stored(tmp_path: Path) -> None:
    store = StoreFile(tmp_path / "store.json")
    memory = store.nonvolatile("5", make_dictionary())
    assert not store.save()
    assert not store.path.exists()
    memory.changed()
    assert store.save()
    assert not store.save()


def test_nodes_have_a_memory_each_and_one_file(tmp_path: Path) -> None:
    store = StoreFile(tmp_path / "store.json")
    for name, node_id in (("left", 1), ("right", 2)):
        memory = store.nonvolatile(name, make_dictionary())
        memory.node_id = node_id
        memory.changed()
    store.save()
    again = StoreFile(tmp_path / "store.json")
    assert [again.nonvolatile(name, make_dictionary()).node_id for name in ("left", "right")] == [
        1,
        2,
    ]
    assert os.listdir(tmp_path) == ["store.json"]


def test_values_of_another_eds_are_dropped(
    tmp_path: Path, caplog: pytest.LogCaptureFixture
) -> None:
    store = StoreFile(tmp_path / "store.json")
    memory = store.nonvolatile("5", make_dictionary())
    memory.parameters = {HEARTBEAT: b"\x64", NAME: bytes(65), 0x5FFF_00: b"\1", 0x2000_00: b"\1"}
    assert store.nonvolatile("5", make_dictionary()).parameters == {0x2000_00: b"\1"}
    assert "node 5: no room for 1017:00" in caplog.text


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("", "not a store file: Expecting value"),
        ("\xff", "not a store file: 'utf-8'"),
        ("[]", "not a store file: its format is not"),
        ('{"format": "other"}', "not a store file: its format is not"),
        ("{F}", "a damaged store file: KeyError('nodes')"),
        ("{F, 'nodes': 5}", "a damaged store file: AttributeError"),
        ("{F, 'nodes': {'5': {}}}", "a damaged store file: KeyError('parameters')"),
        (
            "{F, 'nodes': {'5': {'parameters': {'1017': '00'}}}}",
            "a damaged store file: ValueError('not enough values",
        ),
        (
            "{F, 'nodes': {'5': {'parameters': {}, 'node_id': 128}}}",
            "a damaged store file: ValueError('128 is out of range')",
        ),
    ],
)
def test_a_corrupt_file_is_reported_and_left_alone(tmp_path: Path, text: str, reason: str) -> None:
    path = tmp_path / "store.json"
    text = text.replace("F", "'format': 'tickrig CANopen store 1'").replace("'", '"')
    path.write_bytes(text.encode("latin-1"))
    before = path.read_bytes()
    with pytest.raises(StoreError) as error:
        StoreFile(path)
    assert str(error.value).startswith(f"{path}: {reason}")
    assert "\n" not in str(error.value)
    assert path.read_bytes() == before


def test_a_failed_write_leaves_the_old_file(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "store.json"
    store = StoreFile(path)
    memory = store.nonvolatile("5", make_dictionary())
    memory.changed()
    store.save()
    before = path.read_bytes()
    memory.node_id = 3
    memory.changed()

    def refuse(*_: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "replace", refuse)
    with pytest.raises(OSError, match="No space left"):
        store.save()
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["store.json"]
    monkeypatch.undo()
    assert store.save()
