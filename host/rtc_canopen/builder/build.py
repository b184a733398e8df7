"""All files that are written of a profile."""

from __future__ import annotations

from tickrig.host.rtc_canopen.builder.c_header import write_header
from tickrig.host.rtc_canopen.builder.fragment import write_fragment
from tickrig.host.rtc_canopen.builder.names import check_identifiers, snake_name
from tickrig.host.rtc_canopen.builder.profile_file import Project
from tickrig.host.rtc_canopen.builder.skeleton import SKELETON_SUFFIX, write_skeleton
from tickrig.wire.canopen.eds.eds_writer import write_eds
from tickrig.wire.rtc_canopen.objects import device_info, object_table


def build(project: Project) -> dict[str, str]:
    """Return the text of each file by its name.

    Raises:
        ValueError: names that Python or C cannot have.
    """
    profile = project.profile
    check_identifiers(profile.type_name, (port.name for port in profile.ports))
    stem = snake_name(profile.type_name)
    return {
        f"{stem}.eds": write_eds(object_table(profile), device_info(profile)),
        f"{stem}_od.h": write_header(profile),
        f"{stem}.yaml": write_fragment(project),
        f"{stem}{SKELETON_SUFFIX}": write_skeleton(project),
    }
