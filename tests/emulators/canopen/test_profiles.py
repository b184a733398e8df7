"""Which profile a node gets, and what models there are."""

from __future__ import annotations

from pathlib import Path

import pytest

from tickrig.device.canopen.dictionary import Dictionary
from tickrig.device.canopen.ds401 import Ds401
from tickrig.device.canopen.ds402 import Ds402
from tickrig.device.canopen.slave import Application, ServiceMaker
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.build import describe_nodes, make_nodes
from tickrig.emulators.canopen.eds import application_of
from tickrig.emulators.canopen.node import Node
from tickrig.emulators.canopen.node_spec import NodeSpec, parse_node
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription

EDS = Path(__file__).parents[2] / "golden" / "canopen" / "r1.eds"


def node_of(spec: NodeSpec, profile: str = "auto") -> Node:
    (node,) = make_nodes(describe_nodes([spec], profile), CanWire())
    return node


def of_type(device_type: int) -> Dictionary:
    return Dictionary(
        [
            EntryDescription(
                0x1000, 0, "device type", DataType.UNSIGNED32, Access.READ, default=device_type
            )
        ]
    )


@pytest.mark.parametrize(
    ("device_type", "profile"),
    [
        (0x000F_0191, Ds401),
        (0x0192, Ds402),
        (0x0002_0192, Ds402),
        (0x0193, Application),
        (0, Application),
    ],
)
def test_the_device_type_chooses_the_profile(device_type: int, profile: ServiceMaker) -> None:
    assert application_of(of_type(device_type)) is profile


def test_a_profile_can_be_left_out() -> None:
    bare = node_of(NodeSpec(EDS, 5), "none")
    assert set(bare.physical) == {"power_off", "unplugged", "emergency"}
    assert isinstance(node_of(NodeSpec(EDS, 5)).application, Ds401)


def test_a_profile_of_its_own_comes_first() -> None:
    assert set(node_of(NodeSpec(EDS, 5, "none"), "401").physical) == set(
        node_of(NodeSpec(EDS, 5), "none").physical
    )
    assert isinstance(node_of(NodeSpec(EDS, 5, "401"), "none").application, Ds401)


def test_a_model_has_its_own_profile_and_node_id() -> None:
    node = node_of(NodeSpec("f-palette", None), "none")
    assert node.name == "16"
    assert "ai8_v" in node.physical
    assert node_of(NodeSpec("f-palette", 5)).name == "5"


def test_a_model_is_meant_where_no_file_is_called_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert next(parse_node("5=f-palette")) == NodeSpec("f-palette", 5)
    assert next(parse_node("f-palette")) == NodeSpec("f-palette", None)
    (tmp_path / "f-palette").touch()
    assert next(parse_node("5=f-palette")) == NodeSpec(Path("f-palette"), 5)
