"""Real devices: here an emulated one at a pty, that nobody but the operator can get at."""

from __future__ import annotations

import pytest

from tests.emulators.testing.plugin.conftest import Run, skip_if_too_slow
from tests.host.live import live_rrc, pty
from tickrig.emulators.testing.report.report_file import read_run

pytest_plugins = ("pytester",)


@pytest.mark.realtime
def test_tests_run_on_real_devices(pytester: pytest.Pytester, run: Run) -> None:
    pytester.makepyfile(
        """
        import pytest
        from tickrig.host import RrcClient

        def test_answer(bench):
            with RrcClient(bench.link) as client:
                client.start()

        def test_answer_and_fail(bench):
            bench.link.send(b"hello\\n")
            bench.run_for("100ms")
            assert 0

        @pytest.mark.needs("virtual")
        def test_virtual(bench):
            pass

        @pytest.mark.needs("device:rrc", "input:stick", "fault:bus_unplugged")
        def test_twin(bench):
            bench.fork()
        """
    )
    with pty() as port, live_rrc(port):
        text = f'[device.rrc]\ntype = "rrc"\n[hardware.rrc]\nport = "{port.path}"\n'
        pytester.makefile(".toml", rig=text)
        options = ("--bench", "rig.toml", "--bench-mode", "hardware")
        result = run(*options, "--bench-report", "run.json", "--bench-artifacts", "kept")
    skip_if_too_slow(result)
    result.assert_outcomes(passed=1, failed=1, skipped=2)
    result.stdout.fnmatch_lines(
        [
            "rig.toml with rrc; hardware, seed 0, * s old",
            "*rrc > hello",
            "pytest *::test_answer_and_fail --bench rig.toml --bench-mode hardware",
            "kept/*.txt",
            "SKIPPED *needs virtual, and this bench is hardware",
            "SKIPPED *real devices have no twins",
        ]
    )
    tests = read_run(pytester.path / "run.json").tests
    assert [test.mode for test in tests] == ["hardware"] * 4
