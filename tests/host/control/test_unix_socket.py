from __future__ import annotations

import fcntl
import os
import socket
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from tickrig.host.control.unix_socket import listen_at


def test_of_many_that_begin_at_once_one_listens(tmp_path: Path) -> None:
    path = tmp_path / "control"

    def begin(_: int) -> socket.socket | None:
        try:
            return listen_at(path)
        except FileExistsError:
            return None

    with ThreadPoolExecutor(8) as pool:
        made = [one for one in pool.map(begin, range(8)) if one is not None]
    assert len(made) == 1
    with socket.socket(socket.AF_UNIX) as client:
        client.connect(str(path))
    made[0].close()
    assert list(tmp_path.iterdir()) == [path]


def test_what_is_no_socket_is_left_as_it_is(tmp_path: Path) -> None:
    path = tmp_path / "control"
    path.write_text("a letter", "utf-8")
    with pytest.raises(FileExistsError, match="File exists"):
        listen_at(path)
    assert path.read_text("utf-8") == "a letter"


def test_the_socket_of_a_killed_process_is_replaced(tmp_path: Path) -> None:
    path = tmp_path / "control"
    listen_at(path).close()
    with listen_at(path), socket.socket(socket.AF_UNIX) as client:
        client.connect(str(path))


def test_a_folder_that_another_program_has_locked_is_refused(tmp_path: Path) -> None:
    folder = os.open(tmp_path, os.O_RDONLY)
    fcntl.flock(folder, fcntl.LOCK_EX)
    why = f"another program holds a lock on the folder {tmp_path}"
    with pytest.raises(BlockingIOError, match=why) as refused:
        listen_at(tmp_path / "control")
    assert refused.value.filename == str(tmp_path / "control")
    os.close(folder)
    listen_at(tmp_path / "control").close()
