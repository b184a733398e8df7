from __future__ import annotations

from pathlib import Path

import pytest

from tests.device.canopen.reference import make_dictionary
from tests.host.canopen.conform.bench import Bench, make_bench
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.emulators.canopen.eds import read_eds
from tickrig.host.canopen.conform.binding.binding import bind
from tickrig.host.canopen.conform.binding.capabilities import EdsClaims, NodeFeatures, find_features
from tickrig.host.canopen.eds import open_eds
from tickrig.wire.canopen.eds.eds_device import EdsDevice, read_device
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.object_table import DeviceInfo

ROOT = Path(__file__).parents[5]
R1 = ROOT / "tests/golden/canopen/r1.eds"
EXAMPLES = sorted((ROOT / "examples").rglob("*.eds"))

WITHOUT_EDS = {
    *("heartbeat", "hbcons", "guarding", "emcy", "history", "store", "restore", "sdo2", "sync"),
    *("syncprod", "synccounter", "syncstart", "eventtimer", "inhibit", "time", "tpdo", "rpdo"),
    *("rtr", "block", "401", "unsaved"),
}
OF_R1 = {*WITHOUT_EDS, "dummy5", "dummy6", "bits", "lss", "lssident", "unconfigured"}


def features(bench: Bench, file: EdsFile | None) -> NodeFeatures:
    binding = bind(read_device(file) if file else None, bench.upload)
    return find_features(binding, bench.client, EdsClaims.of_file(file) if file else None)


def test_r1_has_all_but_what_it_has_no_objects_for() -> None:
    found = features(make_bench(make_dictionary()), open_eds(R1))
    assert found.words == OF_R1
    assert set(found.reasons) == {"1029", "1F80", "402"}
    assert found.findings == ()


def test_optional_objects_are_features() -> None:
    found = features(make_bench(make_dictionary({"1029", "1F80"})), None)
    assert {"1029", "1F80"} <= found.words


def test_without_an_eds_a_node_shows_what_it_has() -> None:
    found = features(make_bench(make_dictionary()), None)
    assert found.words == WITHOUT_EDS
    assert found.reasons["lss"] == "without an EDS it is unknown whether it has LSS"


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.stem)
def test_the_examples_contradict_nothing(path: Path) -> None:
    found = features(make_bench(read_eds(path).make_dictionary()), open_eds(path))
    assert {"heartbeat", "block", "tpdo", "rpdo"} <= found.words
    assert found.findings == ()


def test_a_dummy_is_one_that_the_eds_allows() -> None:
    text = R1.read_text("ascii").replace("Dummy0005=1", "Dummy0005=0")
    found = features(make_bench(make_dictionary()), EdsFile("a.eds", text))
    assert found.words == OF_R1 - {"dummy5"}
    assert found.reasons["dummy5"] == (
        "Dummy0005 of the EDS does not say that this dummy may be mapped"
    )


def test_a_node_that_saves_by_itself_is_not_asked_to_forget() -> None:
    bench = make_bench(make_dictionary())
    bench.slave.dictionary[0x1010, 1].value = 3
    assert "unsaved" not in features(bench, None).words


def test_an_eds_that_does_not_tell_of_lss_denies_it() -> None:
    file = EdsFile("a.eds", R1.read_text().replace("LSS_Supported=1", "LSS_Supported=0"))
    found = features(make_bench(make_dictionary()), file)
    assert not found.words & {"lss", "lssident", "unconfigured"}
    assert found.reasons["lss"] == "LSS_Supported of the EDS does not say that it has LSS"


def test_lss_without_an_address_is_a_finding() -> None:
    bare = [entry for entry in make_dictionary() if (entry.index, entry.sub) != (0x1018, 4)]
    bench = make_bench(Dictionary(entry.description for entry in bare))
    device = EdsDevice(DeviceInfo(), tuple(entry.description for entry in bare), {})
    found = find_features(bind(device, bench.upload), bench.client, EdsClaims.of_file(open_eds(R1)))
    assert found.reasons["lss"] == "1018h lacks the four numbers of an LSS address"
    assert found.findings == (
        "the EDS says that it has LSS, but 1018h lacks the numbers of its address",
    )


def test_another_identity_than_the_head_of_the_eds_is_a_finding() -> None:
    file = EdsFile("a.eds", R1.read_text().replace("VendorNumber=0x0000AB01", "VendorNumber=0x12"))
    found = features(make_bench(make_dictionary()), file)
    assert found.findings == ("1018h:01 is 0000AB01h, but the EDS has VendorNumber=00000012h",)


def test_a_drive_without_a_controlword_is_a_finding() -> None:
    bench = make_bench(make_dictionary())
    bench.slave.dictionary[0x1000, 0].value = 0x2_0192
    found = features(bench, open_eds(R1))
    assert "402" in found.words
    assert found.findings == (
        "1000h says that it is a device of CiA 402, but it has none of 6040h, 6041h",
    )


def test_a_number_that_is_none_says_nothing() -> None:
    text = R1.read_text().replace("LSS_Supported=1", "LSS_Supported=yes")
    found = features(make_bench(make_dictionary()), EdsFile("a.eds", text))
    assert "lss" not in found.words


def test_a_block_upload_that_was_tried_leaves_no_transfer_behind() -> None:
    bench = make_bench(make_dictionary())
    features(bench, None)
    before_us = bench.link.now_us
    assert bench.upload(0x1008, 0) == b"reference slave"
    bench.rig.run_for(2_000_000)
    assert bench.link.receive(0) == ()
    assert before_us < bench.link.now_us
