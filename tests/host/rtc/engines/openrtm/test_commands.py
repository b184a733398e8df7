"""`--openrtm` of commands: what is refused, and what the others than `tickrig rtc run` do."""

from __future__ import annotations

import socket
import subprocess
import sys
from pathlib import Path

import pytest
from click.testing import CliRunner

from tests.host.rtc.engines.openrtm.extra import OMNIORB
from tests.host.rtc.engines.openrtm.live_system import has_components, live_system
from tests.host.rtc.engines.openrtm.name_server import eventually, free_port
from tests.host.rtc.engines.openrtm.ports.foreign import Peer, compile_foreign
from tickrig.emulators.bench.child import running
from tickrig.emulators.commands.cli import main
from tickrig.host.control.client import ControlClient
from tickrig.host.rtc.motion.ports import RunMode

CHAIN = Path(__file__).parents[5] / "examples" / "rtc_chain.toml"
EDS = Path(__file__).parents[5] / "examples" / "eds"
PALETTE = f"""
nodes: [{{id: 16, name: Palette0, eds: {EDS}/f-palette.eds, role: device}}]
bus: {{interface: virtual, channel: rtc}}
"""
STICK = "from tickrig.host.rtc.canopen.robots import Joystick as Stick"


@pytest.mark.parametrize(
    ("words", "error"),
    [
        ("--openrtm :", "--openrtm: ':' is not HOST:PORT with a port 1..65535"),
        ("--openrtm a:b", "--openrtm: 'a:b' is not HOST:PORT with a port 1..65535"),
        ("--openrtm a:0", "--openrtm: 'a:0' is not HOST:PORT with a port 1..65535"),
        ("--openrtm a --openrtm-address a/b", "--openrtm-address: 'a/b' is not HOST:PORT"),
        ("--openrtm a --openrtm-names %h/%x.rtc", "--openrtm-names: %x is not one of %n %t %m"),
        ("--openrtm a --openrtm-names %h", "--openrtm-names: '%h' is not like %h.host_cxt/%n.rtc"),
        ("--openrtm a --openrtm-names %n//a", "--openrtm-names: '%n//a' is not like"),
        ("--openrtm-names %n.rtc", "--openrtm-names is for --openrtm"),
        ("--openrtm-address 10.0.0.1", "--openrtm-address is for --openrtm"),
    ],
)
def test_what_cannot_be_is_refused_in_a_line(words: str, error: str) -> None:
    result = CliRunner().invoke(main, ["rtc", "run", *words.split()])
    assert result.exit_code == 2
    assert error in result.output
    assert len(result.output.splitlines()) == 1


WITHOUT = """
import sys
sys.modules["omniORB"] = None
sys.argv[0] = "tickrig"
from tickrig.commands import tickrig
tickrig()
"""


def test_without_the_extra_a_line_says_what_to_install(tmp_path: Path) -> None:
    command = [sys.executable, "-c", WITHOUT, "rtc", "run", "--openrtm", "localhost"]
    done = subprocess.run(
        [*command, "--control", str(tmp_path / "ctl")], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2
    assert done.stderr == "Error: --openrtm needs omniORB: pip install 'tickrig[openrtm]'\n"


@OMNIORB
def test_an_address_that_is_not_of_this_machine_is_refused(tmp_path: Path) -> None:
    words = ["rtc", "run", "--openrtm", "localhost", "--openrtm-address", "203.0.113.5"]
    command = [sys.executable, "-m", "tickrig", *words, "--control", str(tmp_path / "ctl")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    wanted = "Error: --openrtm: cannot listen at 203.0.113.5: no address or free port here\n"
    assert done.stderr == wanted


@OMNIORB
@pytest.mark.realtime
def test_a_server_of_nodes_decides_itself_which_components_there_are(tmp_path: Path) -> None:
    (tmp_path / "stick.py").write_text(STICK, "utf-8")
    (tmp_path / "robot.yaml").write_text(PALETTE, "utf-8")
    words = (str(tmp_path / "robot.yaml"), "--component", f"Stick0={tmp_path}/stick.py:Stick")
    with live_system(tmp_path, *words, command="rtc-canopen-server") as system:
        has_components(system, "Stick0")
        assert system.tool("rtexit", "@/Stick0.rtc") == (0, "", "")  # it looks at no answer
        assert "Stick0.rtc" in system.listed()
        code, said = system.end()
        assert code == 0, said
        assert system.tool("rtls", "@") == (0, "", "")


@OMNIORB
@pytest.mark.realtime
def test_the_components_of_a_cart_are_served_until_it_is_ended(tmp_path: Path) -> None:
    with live_system(tmp_path, command="rh3 serve") as system:
        has_components(system, "PathFollower0")
        assert system.listed()["Odometry0.rtc"] == "Active"
        assert system.tool("rtdeact", "@/Odometry0.rtc") == (0, "", "")
        assert system.listed()["Odometry0.rtc"] == "Inactive"
        assert system.tool("rtact", "@/Odometry0.rtc") == (0, "", "")
        code, said = system.end()
        assert code == 0, said
        assert system.tool("rtls", "@") == (0, "", "")


def at_x(cart: ControlClient) -> float:
    x_m = cart.request("status")["x_m"]
    assert isinstance(x_m, float)
    return x_m


@OMNIORB
@pytest.mark.realtime
def test_a_foreign_component_with_paths_is_joined_by_rtshell(tmp_path: Path) -> None:
    """Its ports are of RTC::Path, as those of the original Navigation and PathFollower."""
    control = tmp_path / "cart"
    with live_system(tmp_path, "--control", str(control), command="rh3 serve") as system:
        has_components(system, "PathFollower0")
        peer = Peer(compile_foreign(tmp_path), name_server=system.names.address)
        theirs = f"/{system.names.address}/peer.host_cxt/Peer0.rtc"
        try:
            for words in (
                ("rtdis", "@/Navigation0.rtc:path", "@/PathFollower0.rtc:target_path"),
                ("rtcon", f"{theirs}:path_out", "@/PathFollower0.rtc:target_path"),
                ("rtcon", "@/Navigation0.rtc:path", f"{theirs}:path_in"),
            ):
                assert (words, system.tool(*words)) == (words, (0, "", ""))
            with ControlClient(control) as cart:
                assert peer.ask("put_path", RunMode.VEL, 0.05, 0.1) == "PORT_OK"
                eventually(lambda: float(str(cart.request("status")["x_m"])) > 0.01, "it stands")
                cart.request("goal", pose=[1, 2, 0])
            eventually(lambda: len(peer.ask("received_paths")) > 0, "no path has come")
            assert peer.ask("received_paths")[0][2] in (RunMode.SPIN, RunMode.STOP)
        finally:
            peer.kill()


@OMNIORB
@pytest.mark.realtime
def test_the_proxy_of_a_device_has_a_name_as_long_as_the_device_has_power(tmp_path: Path) -> None:
    with (
        running("tickrig.emulators.rtc_lite.cli") as device,
        ControlClient(device.control) as hand,
        live_system(tmp_path, "--lite", f"Lite={device.link}", "--rate", "50") as system,
    ):
        has_components(system, "Lite0")
        assert system.tool("rtact", "@/Lite0.rtc") == (0, "", "")
        assert hand.request("get", names=["state"])["values"] == {"state": "Active"}
        hand.request("fault", spec="power_cut")

        def gone() -> bool:  # rtls fails where a component goes while it looks
            code, out, _ = system.tool("rtls", "@")
            return code == 0 and "Lite0.rtc" not in out

        eventually(gone, "the proxy has its name yet")
        hand.request("clear", name="power_cut")
        has_components(system, "Lite0")
        code, said = system.end()
        assert code == 0, said
        assert system.tool("rtls", "@") == (0, "", "")


@OMNIORB
@pytest.mark.realtime
def test_names_and_address_are_as_they_were_asked_for(tmp_path: Path) -> None:
    port = free_port()
    words = ("--openrtm-names", "%h.ours_cxt/%t_%n.rtc", "--openrtm-address", f"localhost:{port}")
    with live_system(tmp_path, str(CHAIN), *words) as system:
        path = f"/{system.names.address}/{socket.gethostname()}.ours_cxt"

        def there() -> bool:
            code, out, _ = system.tool("rtls", path)
            names = {"ConfigSample_ConfigSample0.rtc", "manager.mgr/"}
            return code == 0 and names <= set(out.split())

        eventually(there, "it has no such name")
        code, out, error = system.tool("rtcat", f"{path}/ConsoleIn_ConsoleIn0.rtc")
        assert (code, error) == (0, "")
        with socket.create_connection(("127.0.0.1", port)):
            assert "ConsoleIn0" in out


ASKED = """
import atexit, sys
words = ("omniORB", "host.rtc.engines")
atexit.register(lambda: print([name for name in sys.modules if any(w in name for w in words)]))
sys.argv[0] = "tickrig"
from tickrig.commands import tickrig
tickrig()
"""


def test_without_the_option_nothing_of_it_is_imported() -> None:
    command = [sys.executable, "-c", ASKED, "rtc", "run", "none.toml"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 2
    assert done.stdout == "[]\n"
