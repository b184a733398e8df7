from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import pytest

from tests.device.canopen.reference import make_dictionary
from tests.host.canopen.conform.bench import Bench, make_bench
from tickrig.device.canopen.dictionary import Dictionary
from tickrig.emulators.canopen.eds import read_eds
from tickrig.host.canopen.conform.binding.binding import (
    NAMES,
    Binding,
    BoundObject,
    BoundPlace,
    bind,
)
from tickrig.host.canopen.conform.binding.pdo_binding import BoundPdo
from tickrig.host.canopen.conform.check import Level
from tickrig.host.canopen.eds import read_sound
from tickrig.host.canopen.errors import SdoTimeout
from tickrig.wire.canopen.datatypes import DataType
from tickrig.wire.canopen.eds.eds_device import EdsDevice
from tickrig.wire.canopen.eds.object_table import (
    RO,
    RW,
    RWW,
    WO,
    Access,
    DeviceInfo,
    EntryDescription,
)

ROOT = Path(__file__).parents[5]
R1 = ROOT / "tests/golden/canopen/r1.eds"
EXAMPLES = sorted((ROOT / "examples").rglob("*.eds"))

OF_R1 = {
    "rw_u8": "100D.00",
    "rw_u16": "1015.00",
    "rw_u32": "1007.00",
    "rw_u64": "2003.00",
    "rw_bool": "200C.01",
    "rw_real32": "200A.00",
    "ro_u8": "1001.00",
    "ro_u32": "1000.00",
    "tpdo_u8": "2000.00",
    "rpdo_u16": "2001.00",
    "limited": "2006.00",
    "wo": "2004.00",
    "const": "1008.00",
    "long_string": "1008.00",
    "short_string": "1009.00",
    "string": "2007.00",
    "domain": "2008.00",
    "tpdo_only": "1001.00",
    "rpdo_only": "2004.00",
    "consumer_2": "1016.02",
    "sdo_server_2": "1201.01",
    "absent_object": "5FFF.00",
    "absent_sub": "1018.05",
    "sub_of_variable": "1000.01",
    "tpdo_async": "1800.00",
    "tpdo_disabled": "1802.00",
    "rpdo_remappable": "1400.00",
}

MODULE, DRIVE = (
    EntryDescription(0x1000, 0, "Device type", DataType.UNSIGNED32, RO, default=profile)
    for profile in (401, 402)
)


def r1_device() -> EdsDevice:
    return read_sound(R1)[0]


def device(*entries: EntryDescription) -> EdsDevice:
    return EdsDevice(DeviceInfo(), entries, {})


def bench_of(*entries: EntryDescription) -> Bench:
    return make_bench(Dictionary(entries))


def bound_to(*entries: EntryDescription, allow: Collection[int] = ()) -> Binding:
    return bind(device(*entries), bench_of(*entries).upload, allow=allow)


def place(binding: Binding, name: str) -> str:
    bound = binding.bound[name]
    return f"{bound.index:04X}.{0 if isinstance(bound, BoundPdo) else bound.sub:02X}"


def test_names_of_r1_mean_its_objects() -> None:
    binding = bind(r1_device(), make_bench(make_dictionary()).upload)
    assert {name: place(binding, name) for name in OF_R1} == OF_R1
    assert binding.findings == ()


@pytest.mark.parametrize("path", [R1, *EXAMPLES], ids=lambda path: path.stem)
def test_every_name_is_bound_or_has_a_reason(path: Path) -> None:
    bench = make_bench(read_eds(path).make_dictionary())
    for known in (read_sound(path)[0], None):
        binding = bind(known, bench.upload)
        assert set(binding.bound) | set(binding.reasons) == NAMES
        assert not set(binding.bound) & set(binding.reasons)
        assert binding.findings == ()


def test_a_bound_object_tells_what_it_held_and_who_may_write_it() -> None:
    bench = make_bench(make_dictionary())
    bench.slave.dictionary[0x1015, 0].value = 0x1234
    bound = bind(r1_device(), bench.upload).bound
    inhibit, wide, secret = bound["rw_u16"], bound["rw_u64"], bound["wo"]
    assert isinstance(inhibit, BoundObject)
    assert isinstance(wide, BoundObject)
    assert isinstance(secret, BoundObject)
    assert (inhibit.value, inhibit.level) == (b"\x34\x12", Level.COMMUNICATION)
    assert (wide.value, wide.level) == (bytes(8), Level.INTRUSIVE)
    assert secret.value is None


def test_a_bound_pdo_is_as_the_node_has_it() -> None:
    bench = make_bench(make_dictionary())
    bench.slave.dictionary[0x1801, 2].value = 10
    pdo = bind(r1_device(), bench.upload).bound["tpdo_sync"]
    assert isinstance(pdo, BoundPdo)
    assert (pdo.index, pdo.mapping_index, pdo.can_id) == (0x1801, 0x1A01, 0x285)
    assert (pdo.enabled, pdo.size, pdo.places) == (True, 8, 8)
    assert pdo.mapping == tuple(0x6401_0010 + (sub << 8) for sub in range(1, 5))


def test_without_an_eds_only_what_cia_301_knows_is_bound() -> None:
    binding = bind(None, make_bench(make_dictionary()).upload)
    assert place(binding, "rw_u16") == "1015.00"
    assert place(binding, "sdo_server_2") == "1201.01"
    assert place(binding, "tpdo_async") == "1800.00"
    assert binding.reasons["domain"].startswith("without an EDS there is no known domain")
    written = [bound for bound in binding.bound.values() if isinstance(bound, BoundObject)]
    assert all(0x1000 <= bound.index < 0x2000 for bound in written)


def test_an_object_of_the_profile_is_bound_only_if_it_is_allowed() -> None:
    output = EntryDescription(0x6200, 1, "Output", DataType.UNSIGNED8, RW)
    binding = bound_to(MODULE, output)
    assert binding.reasons["rw_u8"] == (
        "6200h is the only integer of 8 bits that may be read and written; "
        "writing it may move something (--allow 6200h)"
    )
    assert place(bound_to(MODULE, output, allow={0x6200}), "rw_u8") == "6200.01"


@pytest.mark.parametrize(
    ("profile", "index"), [(MODULE, 0x6421), (MODULE, 0x6060), (DRIVE, 0x6060), (DRIVE, 0x6200)]
)
def test_what_means_something_in_its_profile_stands_for_nothing(
    profile: EntryDescription, index: int
) -> None:
    mode = EntryDescription(index, 0, "Mode", DataType.UNSIGNED8, RW)
    for allow in (set[int](), {index}):
        assert bound_to(profile, mode, allow=allow).reasons["rw_u8"] == (
            "no integer of 8 bits that may be read and written accepts any value: "
            f"values of {index:04X}h have a meaning"
        )


def test_an_object_that_must_never_be_written_is_not_bound() -> None:
    bench = make_bench(make_dictionary())
    binding = bind(r1_device(), bench.upload, never={0x2003, 0x1018})
    assert binding.reasons["rw_u64"].endswith("and --never forbids to write it")
    assert place(binding, "absent_sub") == "1016.05"


def test_what_can_be_read_may_be_mapped_into_a_tpdo_whatever_its_eds_says() -> None:
    pressure = EntryDescription(0x2000, 0, "Set pressure", DataType.INTEGER16, RWW)
    secret = EntryDescription(0x2001, 0, "Secret", DataType.INTEGER16, WO | Access.RPDO)
    assert bound_to(pressure).reasons["rpdo_only"] == (
        "the EDS has no write-only object that may be mapped into RPDOs"
    )
    assert place(bound_to(pressure, secret), "rpdo_only") == "2001.00"


def test_an_rpdo_is_ready_only_if_all_that_it_writes_is_harmless() -> None:
    known, bench = r1_device(), make_bench(make_dictionary())
    assert "mapped_rpdo" in bind(known, bench.upload).reasons
    assert place(bind(known, bench.upload, allow={0x6200}), "mapped_rpdo") == "1400.00"


def test_what_the_node_does_not_have_is_a_finding_and_the_next_is_taken() -> None:
    described = [
        EntryDescription(index, 0, "Gain", DataType.UNSIGNED64, RW) for index in (0x2000, 0x2001)
    ]
    binding = bind(device(*described), bench_of(described[1]).upload)
    assert place(binding, "rw_u64") == "2001.00"
    assert binding.findings == (
        "2000h:00 Gain is described, but the node does not have it: "
        "object does not exist (06020000h)",
    )


def test_another_size_than_described_is_a_finding() -> None:
    described = EntryDescription(0x2000, 0, "Gain", DataType.UNSIGNED32, RW)
    bench = bench_of(EntryDescription(0x2000, 0, "Gain", DataType.UNSIGNED16, RW))
    binding = bind(device(described), bench.upload)
    assert "rw_u32" in binding.reasons
    assert binding.findings == (
        "2000h:00 Gain is described as UNSIGNED32, but the node sends 2 bytes",
    )


def test_what_is_not_described_and_there_is_a_finding() -> None:
    hidden = EntryDescription(0x5FFF, 0, "Hidden", DataType.UNSIGNED8, RW)
    binding = bind(device(), bench_of(hidden).upload)
    assert binding.bound["absent_object"] == BoundPlace(0x5FFE, 0)
    assert binding.findings == ("5FFFh:00 is not described, but the node has it",)


def test_what_cannot_be_read_is_not_written() -> None:
    secret = EntryDescription(0x2000, 0, "Secret", DataType.UNSIGNED32, WO)
    assert "rw_u32" in bound_to(secret).reasons


def test_a_node_that_does_not_answer_is_given_up() -> None:
    bench = bench_of(EntryDescription(0x2000, 0, "Gain", DataType.UNSIGNED8, RW))
    bench.wire.faults.arm("short")
    before_us = bench.link.now_us
    for known in (r1_device(), None):
        with pytest.raises(SdoTimeout):
            bind(known, bench.upload)
    assert bench.link.now_us - before_us == 2 * 3 * 2 * 500_000  # each of three is asked twice
