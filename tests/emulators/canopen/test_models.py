"""The models, and the EDS files of them that are shipped."""

from __future__ import annotations

from pathlib import Path

import canopen
import pytest
from canopen.objectdictionary import ODVariable, import_od

from tickrig.device.canopen.dictionary import Dictionary
from tickrig.emulators.can.wire import CanWire
from tickrig.emulators.canopen.build import describe_nodes, make_bench, make_nodes
from tickrig.emulators.canopen.eds import read_eds
from tickrig.emulators.canopen.models import MODELS, EmulatedModel
from tickrig.emulators.canopen.node import NODE_OUTPUTS
from tickrig.emulators.canopen.node_spec import NodeSpec
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.canopen.eds.object_table import Access, EntryDescription, ObjectCode

SHIPPED = Path(__file__).parents[3] / "examples" / "eds"
each_model = pytest.mark.parametrize("model", MODELS.values(), ids=MODELS)


def in_library(path: Path) -> dict[tuple[int, int], ODVariable]:
    """Return what the canopen library finds beside the data types, for node-ID 0."""
    objects: canopen.ObjectDictionary = import_od(str(path), 0)
    found = {}
    for item in objects.values():
        for variable in [item] if isinstance(item, ODVariable) else item.values():
            found[variable.index, variable.subindex] = variable
    return {at: variable for at, variable in found.items() if at[0] >= 0x1000}


def default_of(entry: EntryDescription) -> object:
    value = entry.data_type.decode(entry.default)
    return entry.data_type.encode(value) if isinstance(value, bytes) else value


@each_model
def test_the_shipped_eds_is_what_the_model_writes(model: EmulatedModel) -> None:
    description = model.describe()
    text = (SHIPPED / f"{model.name}.eds").read_text("utf-8")
    name = f"{model.name}.eds"
    again = f"canopen-slave-emu --model {model.name} --write-eds examples/eds/{name}"
    assert text == write_eds(description.template.description, description.info, file_name=name), (
        f"write it again: {again}"
    )


def test_each_shipped_eds_has_its_model() -> None:
    assert {path.stem for path in SHIPPED.glob("*")} == set(MODELS)


@each_model
def test_the_canopen_library_reads_the_shipped_eds(model: EmulatedModel) -> None:
    library = in_library(SHIPPED / f"{model.name}.eds")
    entries = {(entry.index, entry.sub): entry for entry in model.dictionary().description}
    assert library.keys() == entries.keys()
    for at, entry in entries.items():
        theirs = library[at]
        assert theirs.name == entry.name
        assert theirs.data_type == entry.data_type
        assert theirs.default == default_of(entry)
        assert theirs.readable is entry.readable
        assert theirs.writable is (entry.writable and Access.CONST not in entry.access)
        assert theirs.pdo_mappable is bool(entry.access & (Access.TPDO | Access.RPDO))


@each_model
def test_the_shipped_eds_gives_the_same_dictionary(model: EmulatedModel) -> None:
    def rows(dictionary: Dictionary) -> list[tuple[object, ...]]:
        return [
            (entry.key, entry.name, entry.data_type, entry.access, entry.default, entry.relative)
            for entry in dictionary.description
        ]

    again = read_eds(SHIPPED / f"{model.name}.eds")
    assert rows(again.template) == rows(model.dictionary())
    assert again.template.objects == model.dictionary().objects
    assert again.info == model.describe().info


@each_model
def test_the_canopen_library_finds_the_pdos_of_the_shipped_eds(model: EmulatedModel) -> None:
    network = canopen.Network()
    node = network.add_node(model.node_id, str(SHIPPED / f"{model.name}.eds"))
    template = model.dictionary()
    for first, maps in ((0x1400, node.rpdo), (0x1800, node.tpdo)):
        for number, pdo in maps.items():
            pdo.read(from_od=True)
            at = first + number - 1
            count = template[at + 0x200, 0].number
            words = [entry.number for entry in template.elements(at + 0x200, count)]
            theirs = [(v.index, v.subindex, v.length) for v in pdo]
            assert theirs == [(word >> 16, word >> 8 & 0xFF, word & 0xFF) for word in words]
            assert pdo.cob_id == (template[at, 1].number & 0x7FF) + model.node_id
        area = range(first, first + 0x200)
        assert len(maps) == sum(index in area for index in template.objects)


@each_model
def test_each_model_boots_and_is_quiet(model: EmulatedModel) -> None:
    wire = CanWire()
    nodes = make_nodes(describe_nodes([NodeSpec(model.name, None)]), wire)
    bench = make_bench(wire, nodes)
    while bench.rig.now_us < 50_000 and bench.rig.next_us < 50_000:
        bench.step()
    heard = [line.data.decode().strip() for line in bench.log.since(0)]
    assert heard == [f"{0x700 + model.node_id:03X}#00"]


@each_model
def test_no_output_of_a_model_hides_one_that_every_node_has(model: EmulatedModel) -> None:
    (node,) = make_nodes(describe_nodes([NodeSpec(model.name, None)]), CanWire())
    assert not {item.name for item in NODE_OUTPUTS} & node.application.outputs.keys()
    for name in node.outputs:
        node.read(name)


def test_what_cia_calls_an_array_is_one() -> None:
    objects = MODELS["epos"].dictionary().objects
    arrays = {0x1003, 0x1010, 0x1011, 0x1016, 0x1029, 0x607D, 0x6099, 0x60C1}
    assert {index for index, info in objects.items() if info.code is ObjectCode.ARRAY} == arrays
