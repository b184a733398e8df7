"""Capabilities of a node that checks need, taken from its EDS and confirmed by the node."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Final, NamedTuple

from tickrig.host.canopen.conform.binding.binding import Binding, BoundObject
from tickrig.host.canopen.conform.bus.sdo import SdoClient
from tickrig.host.canopen.dialogue import Script, SdoFrame, SdoRequest
from tickrig.host.canopen.eds import eds_number
from tickrig.host.canopen.errors import SdoMisnamed, SdoTimeout
from tickrig.wire.canopen import sdo_frame
from tickrig.wire.canopen.eds.eds_device import EdsDevice, read_device
from tickrig.wire.canopen.eds.eds_file import EdsFile
from tickrig.wire.canopen.eds.object_table import DeviceInfo, EntryDescription, ObjectDescription
from tickrig.wire.canopen.sdo import Abort

_OF_OBJECTS: Final[Mapping[str, tuple[str, ...]]] = {
    "heartbeat": ("heartbeat",),
    "hbcons": ("consumer_1",),
    "guarding": ("guard_time", "life_factor"),
    "emcy": ("emcy_cob_id",),
    "history": ("error_history",),
    "1029": ("error_behaviour",),
    "1F80": ("startup",),
    "store": ("store",),
    "restore": ("restore",),
    "sdo2": ("sdo_server_2",),
    "sync": ("sync_cob_id",),
    "syncprod": ("sync_cob_id", "sync_period"),
    "synccounter": ("sync_counter",),
    "syncstart": ("tpdo_sync_start",),
    "eventtimer": ("tpdo_event_timer",),
    "inhibit": ("tpdo_inhibit",),
    "time": ("time_cob_id",),
    "tpdo": ("tpdo_remappable",),
    "rpdo": ("rpdo_remappable",),
    "rtr": ("tpdo_remappable",),
    "bits": ("tpdo_bool",),
}
"""Features, and the names whose objects must exist for each feature."""

_PROFILES: Final[Mapping[str, tuple[int, tuple[int, ...]]]] = {
    "401": (401, (0x6000, 0x6200, 0x6400, 0x6401, 0x6411)),
    "402": (402, (0x6040, 0x6041)),
}
"""Profile number (the low word of 1000h), and objects of which at least one must exist."""

_LSS: Final = ("lss", "lssident", "unconfigured")
_IDENTITY: Final = ((1, "VendorNumber"), (2, "ProductNumber"), (3, "RevisionNumber"))
_DEVICE_TYPE: Final = 0x1000
_ON_COMMAND: Final = {"store": 0x1010, "restore": 0x1011}
"""Optional functions of objects. Bit 0 of the first sub-index is set if they are supported."""
_STORE: Final = 0x1010
_AUTONOMOUSLY: Final = 2
_LSS_ADDRESS: Final = 0x1018
_LSS_NUMBERS: Final = frozenset(range(1, 5))
"""The sub-indices that an LSS address needs (CiA 305)."""


_DUMMIES: Final = {"dummy5": "dummy0005", "dummy6": "dummy0006"}
"""Dummy objects that checks map in place of an object, with their names in an EDS."""


class EdsClaims(NamedTuple):
    """Capabilities of a node that its EDS states outside the list of objects.

    Attributes:
        lss: whether the node supports LSS.
        dummies: names of the dummy objects that the node allows in a PDO mapping, such as `dummy5`.
            Checks use the same names.
        identity: vendor-ID, product code and revision number of the identity object 1018h, by
            sub-index. They come from the section DeviceInfo of the EDS, and numbers that are
            missing there are left out.
    """

    lss: bool
    dummies: frozenset[str]
    identity: Mapping[int, int]

    @classmethod
    def of_file(cls, file: EdsFile) -> EdsClaims:
        """Read the claims of an EDS."""
        info, dummies = (file.sections.get(name, {}) for name in ("DeviceInfo", "DummyUsage"))
        numbers = {sub: eds_number(info.get(key.lower(), "")) for sub, key in _IDENTITY}
        return cls(
            bool(eds_number(info.get("lss_supported", ""))),
            frozenset(
                word for word, key in _DUMMIES.items() if eds_number(dummies.get(key.lower(), ""))
            ),
            {sub: number for sub, number in numbers.items() if number is not None},
        )


class NodeDescription(NamedTuple):
    """Description of a node under test by its EDS, before the tester sends any request to the node.

    Attributes:
        device: device with the objects that the EDS describes.
        claims: capabilities that only the EDS states, such as LSS.
        wrong: errors and warnings found in the EDS.
    """

    device: EdsDevice
    claims: EdsClaims
    wrong: tuple[str, ...] = ()

    @classmethod
    def of_file(cls, file: EdsFile) -> NodeDescription:
        """Read the description of a node from a file."""
        device = read_device(file)
        return cls(device, EdsClaims.of_file(file), tuple(map(str, (*file.errors, *file.warnings))))

    @classmethod
    def of_table(
        cls, entries: Iterable[EntryDescription], objects: Mapping[int, ObjectDescription]
    ) -> NodeDescription:
        """Make the description of an emulated node from its object table, without writing an EDS.

        The result is the same as from an EDS with these objects. The default value of each numeric
        object is its value at power-on. An object whose value is an empty text has no default
        value.
        """
        rows = tuple(entries)
        said = [row if row.has_default is bool(row.default) else _as_said(row) for row in rows]
        address = {row.sub: row.default for row in rows if row.index == _LSS_ADDRESS}
        identity = {sub: int.from_bytes(address.get(sub, b""), "little") for sub, _ in _IDENTITY}
        claims = EdsClaims(address.keys() >= _LSS_NUMBERS, frozenset(_DUMMIES), identity)
        return cls(EdsDevice(DeviceInfo(), tuple(said), objects), claims)


def _as_said(row: EntryDescription) -> EntryDescription:
    """Return an entry with the default that its EDS gives."""
    if row.default:
        return row.with_default(row.default, relative=row.relative)
    return EntryDescription(
        *(row.index, row.sub, row.name, row.data_type, row.access),
        max_bytes=row.max_bytes,
        unit=row.unit,
        factor=row.factor,
    )


@dataclass(frozen=True, slots=True)
class NodeFeatures:
    """Features that the node under test has or lacks, for deciding which checks are applicable.

    Attributes:
        words: names of the features that the node has, as checks write them.
        reasons: text for each missing feature that explains why the feature counts as missing.
        findings: texts about contradictions between the EDS and the node.
    """

    words: frozenset[str]
    reasons: Mapping[str, str]
    findings: tuple[str, ...] = ()


def find_features(
    binding: Binding, client: SdoClient, claims: EdsClaims | None = None
) -> NodeFeatures:
    """Find out which features the node under test has, without writing to the node.

    Only the EDS shows whether the node supports LSS, because a trial would change the state of all
    nodes on the bus. Without an EDS the tester assumes that the node has no LSS.

    Args:
        binding: assignment of the names in checks to objects of the node.
        client: SDO client that tries a block upload.
        claims: capabilities that the EDS states, or None without an EDS.
    """
    reasons = dict(_missing(binding))
    for word, key in _DUMMIES.items():
        if claims is None or word not in claims.dummies:
            reasons[word] = _unsaid(claims, key.title(), "this dummy may be mapped")
    number = binding.reader.number
    if (number(_STORE, 1) or 0) & _AUTONOMOUSLY:
        reasons["unsaved"] = f"{_STORE:04X}h:01 says that the node saves by itself (bit 1)"
    for word, index in _ON_COMMAND.items():
        said = number(index, 1)
        if said is not None and not said & 1:
            reasons[word] = f"{index:04X}h:01 says that there is no such command (bit 0)"
    if _has_constant_heartbeat(binding):
        reasons["guarding"] = "1017h is constant and not 0: heartbeat replaces node guarding"
    findings = [*_profile(binding), *_identity(binding, claims.identity if claims else {})]
    if claims is not None and claims.lss and not _has_lss_address(binding):
        reasons |= dict.fromkeys(_LSS, "1018h lacks the four numbers of an LSS address")
        findings.append("the EDS says that it has LSS, but 1018h lacks the numbers of its address")
    if claims is None or not claims.lss:
        reasons |= dict.fromkeys(_LSS, _unsaid(claims, "LSS_Supported", "it has LSS"))
    if not _has_block_upload(client):
        reasons["block"] = "it refuses a block upload of 1000h"
    words = {*_OF_OBJECTS, *_PROFILES, *_LSS, *_DUMMIES, "unsaved", "block"} - reasons.keys()
    return NodeFeatures(frozenset(words), reasons, tuple(findings))


def _has_block_upload(client: SdoClient) -> bool:
    """Return whether a node starts a block upload of 1000h. Abort the upload then."""
    try:
        return client.run(_try_block_upload())
    except SdoMisnamed:
        return True  # the checks of the block upload judge which object the answer names
    except SdoTimeout:
        return False


def _try_block_upload() -> Script[bool]:
    request = sdo_frame.BlockUploadInitiateRequest(
        _DEVICE_TYPE, 0, crc=True, block_size=1, threshold=0
    )
    answer = yield SdoRequest(request.encode(), _DEVICE_TYPE, 0)
    if not isinstance(answer, sdo_frame.BlockUploadInitiateResponse):
        return False
    yield SdoFrame(Abort(_DEVICE_TYPE, 0, sdo_frame.AbortCode.GENERAL).encode())
    return True


def _missing(binding: Binding) -> Iterator[tuple[str, str]]:
    for word, names in _OF_OBJECTS.items():
        for name in names:
            if name in binding.reasons:
                yield word, binding.reasons[name]
    for word, (number, _) in _PROFILES.items():
        if _profile_number(binding) != number:
            yield word, f"1000h does not say that it is a device of CiA {number}"


def _unsaid(claims: EdsClaims | None, key: str, what: str) -> str:
    if claims is None:
        return f"without an EDS it is unknown whether {what}"
    return f"{key} of the EDS does not say that {what}"


def _has_lss_address(binding: Binding) -> bool:
    """Return whether 1018h has vendor, product, revision and serial number (CiA 305)."""
    return all((_LSS_ADDRESS, sub) in binding.entries for sub in _LSS_NUMBERS)


def _has_constant_heartbeat(binding: Binding) -> bool:
    bound = binding.bound.get("heartbeat")
    if not isinstance(bound, BoundObject) or (bound.entry.writable and not bound.entry.low):
        return False
    return any(bound.value or b"")


def _profile_number(binding: Binding) -> int | None:
    bound = binding.bound.get("device_type")
    if isinstance(bound, BoundObject) and bound.value is not None:
        return int.from_bytes(bound.value[:2], "little")
    return None


def _profile(binding: Binding) -> Iterator[str]:
    """Compare 1000h with the objects of its profile."""
    number = _profile_number(binding)
    present = {entry.index for entry in binding.device.entries}
    for wanted, objects in _PROFILES.values():
        if number == wanted and binding.known and not present.intersection(objects):
            names = ", ".join(f"{index:04X}h" for index in objects)
            yield f"1000h says that it is a device of CiA {wanted}, but it has none of {names}"


def _identity(binding: Binding, claimed: Mapping[int, int]) -> Iterator[str]:
    """Compare 1018h with the section DeviceInfo of the EDS."""
    for sub, key in _IDENTITY:
        said, bound = claimed.get(sub), binding.bound.get(f"identity_{sub}")
        if said is None or not isinstance(bound, BoundObject) or bound.value is None:
            continue
        held = int.from_bytes(bound.value, "little")
        if held != said:
            yield f"1018h:{sub:02X} is {held:08X}h, but the EDS has {key}={said:08X}h"
