from __future__ import annotations

from pathlib import Path

import pytest

from tickrig.host.canmon.workspace import MonitorSetup, Workspace, WorkspaceError
from tickrig.host.cli.can_options import BusOptions

TEXT = """\
[bus]
source = ["can0", "run.log"]
bitrate = 500000
dbc = ["car.dbc"]
eds_dir = ["eds"]
bus_kwargs = ["port=1"]
[nodes.3]
eds = "drive.eds"
name = "left wheel"
"""


def test_paths_are_taken_from_the_folder_of_the_file(tmp_path: Path) -> None:
    setup = MonitorSetup.read(Workspace(TEXT, tmp_path / "bench.toml"))
    assert setup == MonitorSetup(
        source=("can0", str(tmp_path / "run.log")),
        options=BusOptions(bitrate=500_000, bus_kwargs=("port=1",)),
        eds={3: tmp_path / "drive.eds"},
        dbc=(tmp_path / "car.dbc",),
        eds_dir=(tmp_path / "eds",),
    )


def test_it_is_written_as_it_was_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    workspace = Workspace(TEXT, tmp_path / "bench.toml")
    monkeypatch.chdir("/")
    MonitorSetup.read(workspace).write(workspace)
    assert workspace.text == TEXT


def test_the_command_line_goes_before(tmp_path: Path) -> None:
    kept = MonitorSetup.read(Workspace(TEXT, tmp_path / "bench.toml"))
    assert kept.under(MonitorSetup()) == kept
    said = MonitorSetup(source=("can1",), eds={4: Path("io.eds")})
    both = kept.under(said)
    assert (both.source, both.options) == (("can1",), BusOptions(bitrate=500_000))
    assert both.eds == {3: tmp_path / "drive.eds", 4: Path("io.eds")}
    other = kept.under(MonitorSetup(options=BusOptions(interface="virtual", channel="a")))
    assert other.source == ()
    assert other.options.interface == "virtual"


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("[bus]\nsource = 'can0'\n", "line 2: bus.source: is no array of texts"),
        ("[bus]\n\nbitrate = 'fast'\n", "line 3: bus.bitrate: 'fast' is not a number of bit/s"),
        ('[bus]\nsource = ["a\\u0000"]\n', "line 2: bus.source: is no array of texts"),
        ('[nodes.3]\neds = "a\\u0000"\n', 'nodes.3: is no table with eds = "FILE"'),
        ("[bus]\neds_dir = 'eds'\n", "line 2: bus.eds_dir: is no array of texts"),
        ("[bus]\ninterface = 3\n", "line 2: bus.interface: 3 is no text"),
        ("[nodes.3]\n[nodes.200]\neds = ''\n", "line 2: nodes.200: is not a node-ID 1..127"),
        ("[nodes]\nx = {}\n", "line 2: nodes.x: is not a node-ID 1..127"),
        ("[nodes]\n3 = 'a.eds'\n", "line 2: nodes.3: is no table with eds"),
    ],
)
def test_a_wrong_setting_is_told_with_its_line(text: str, reason: str) -> None:
    with pytest.raises(WorkspaceError, match=reason):
        MonitorSetup.read(Workspace(text, Path("bench.toml")))
