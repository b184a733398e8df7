"""The pytest plug-in: options, markers and fixtures; other modules are imported on demand.

Entry point `pytest11`: every pytest of an environment with tickrig loads this module.
"""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import contextmanager
from inspect import iscoroutinefunction
from pkgutil import resolve_name
from typing import TYPE_CHECKING, Any, Final

import pytest

from tickrig._lazy import LazyModule
from tickrig.emulators.testing.plugin.settings import OPTIONS, RANDOM, SETTINGS, PluginSettings
from tickrig.emulators.testing.plugin.stash import BENCHED, is_blocked, skipped_where_it_cannot

if TYPE_CHECKING:
    from tickrig.emulators.testing.bench.bench import Bench
    from tickrig.emulators.testing.plugin import bench_source, benched_test, verdict
    from tickrig.emulators.testing.plugin.bench_source import BenchSource, WarmUp
    from tickrig.emulators.testing.plugin.health import SafeState
    from tickrig.host.text import whole_file
else:
    _HERE = "tickrig.emulators.testing.plugin"
    bench_source = LazyModule(f"{_HERE}.bench_source")
    benched_test = LazyModule(f"{_HERE}.benched_test")
    verdict = LazyModule(f"{_HERE}.verdict")
    whole_file = LazyModule("tickrig.host.text.whole_file")

MARKERS: Final = (
    "needs(*what): skip the test unless its bench has all of it, such as 'virtual', 'hand', "
    "'fault:cut', 'input:stick', 'output:state', 'device:rrc', 'virtual or real' (tickrig)",
    "req(*names): the test shows these requirements; JUnit files and reports name them (tickrig)",
    "allows(*what): allow events that otherwise fail the test: 'lost' (data lost in a full "
    "buffer), 'error frames', 'threads' (a thread that dies), 'clock' (calls of the "
    "machine's clock in virtual time), and 'long waits' of hosts (tickrig)",
)

_PLUGINS: Final = {
    "compare": "tickrig.emulators.testing.plugin.compare:Compare",
    "parameters": "tickrig.emulators.testing.plugin.parameters:ParameterPlugin",
    "report": "tickrig.emulators.testing.plugin.report_plugin:ReportPlugin",
}
"""Plug-ins by the setting that enables them; arguments are the configuration and the settings."""

_EXAMPLES: Final = {"needs": "fault:cut", "req": "SAF-12", "allows": "lost"}
"""Example of a name for each marker."""

_OTHER_LOOPS: Final = ("asyncio", "anyio", "trio", "twisted")
"""Markers of async tests that other plug-ins run."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """Register the options of the command line and of the configuration file."""
    group = parser.getgroup("tickrig", "benches of tickrig")
    for option in OPTIONS:
        flag, name, text = option.flag, option.name, option.text
        if option.metavar:
            action = "append" if option.many else "store"
            group.addoption(flag, dest=name, action=action, metavar=option.metavar, help=text)
        else:
            group.addoption(flag, dest=name, action="store_const", const="true", help=text)
        parser.addini(name, text, default="")


def pytest_configure(config: pytest.Config) -> None:
    """Register the markers, and read the settings."""
    for line in MARKERS:
        config.addinivalue_line("markers", line)
    if (config.getoption("bench_seed") or config.getini("bench_seed")) == RANDOM:
        config.option.bench_seed = _any_seed()  # so the workers of pytest-xdist get it too
    settings = config.stash[SETTINGS] = PluginSettings.of(config)
    config.pluginmanager.register(_mode_fixture(settings.modes), "tickrig-bench-mode")
    if settings != PluginSettings():
        _prepare(config, settings)


def pytest_report_header(config: pytest.Config) -> str | None:
    """Return the settings of the command line."""
    return config.stash[SETTINGS].head or None


def _any_seed() -> str:
    from secrets import randbelow  # noqa: PLC0415 - not always

    return str(randbelow(1_000_000))


def _mode_fixture(modes: tuple[str, ...]) -> object:
    """Return a plug-in with the fixture `bench_mode`, which has a parameter for each mode."""

    class ModeFixture:
        @pytest.fixture(params=modes if len(modes) > 1 else None)
        def bench_mode(self, request: pytest.FixtureRequest) -> str:
            """The mode of the bench, set by `--bench-mode`: virtual, real or hardware."""
            mode: str = getattr(request, "param", modes[0])
            return mode

    return ModeFixture()


@pytest.hookimpl(wrapper=True)
def pytest_pycollect_makeitem(collector: pytest.Collector) -> Generator[None, Any, Any]:
    """Refuse tests with markers without names: such a marker has no effect."""
    made = yield
    for item in made if isinstance(made, list) else ():
        if isinstance(item, pytest.Function):
            _check_markers(collector, item)
    return made


def _check_markers(collector: pytest.Collector, item: pytest.Function) -> None:
    """Raise CollectError for a marker without names.

    Markers other than `req` are checked only in tests with a bench, because other packages may have
    markers of the same name.
    """
    benched = "bench" in item.fixturenames
    for marker in item.iter_markers():
        example = _EXAMPLES.get(marker.name)
        if example is None or not (benched or marker.name == "req"):
            continue
        place, wrong = f"{item.name}: @{marker.name}", ""
        if not (marker.args or marker.kwargs):
            wrong = f"names nothing: write @pytest.mark.{marker.name}({example!r})"
        elif benched and marker.kwargs:
            named = ", ".join(f"{key}={value!r}" for key, value in marker.kwargs.items())
            wrong = f"takes names alone, as {example!r}, not {named}"
        elif benched and (
            no := [each for each in marker.args if not (isinstance(each, str) and each)]
        ):
            wrong = f"takes names as texts, not {no[0]!r}"
        if wrong:
            raise collector.CollectError(f"{place} {wrong}")


@pytest.fixture
def bench_config(request: pytest.FixtureRequest) -> BenchSource:
    """Fixture that describes the bench: override it to return a device, arguments or a rig file."""
    source: BenchSource = getattr(request, "param", None)
    return source


@pytest.fixture
def bench_safe() -> SafeState:
    """Fixture with the values that outputs must have after a test.

    Override it to return values by name, or a function that checks the bench.
    """
    return None


@pytest.fixture
def bench_warm_up() -> WarmUp:
    """Fixture that prepares the bench before a test.

    Override it to return a function that gets the bench.
    """
    return None


@pytest.fixture
def bench(
    request: pytest.FixtureRequest,
    bench_config: BenchSource,
    bench_mode: str,
    bench_safe: SafeState,
    bench_warm_up: WarmUp,
) -> Iterator[Bench]:
    """A new bench for each test, from `bench_config` or `--bench`, which is checked afterwards."""
    source: BenchSource = getattr(request, "param", bench_config)
    with benched_test.benched(request, source, bench_mode, bench_safe, bench_warm_up) as opened:
        yield opened


@pytest.fixture
def bench_time(bench: Bench) -> Iterator[Any]:
    """The clock of the bench, which `time.sleep` and `time.monotonic` of hosts use too."""
    with benched_test.clocked(bench) as clock:
        yield clock


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> Generator[None, None, None]:
    """Record requirements; skip a test if its bench cannot provide its fixtures."""
    names = (("req", name) for marker in item.iter_markers("req") for name in marker.args)
    item.user_properties.extend(each for each in names if each not in item.user_properties)
    with skipped_where_it_cannot():
        return (yield)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_call(item: pytest.Item) -> Generator[None, None, None]:
    """Hook of pytest that skips a test if its bench cannot run it.

    A test that leaves its bench in a bad state fails.
    """
    test = item.stash.get(BENCHED, None)
    if test is None:
        return (yield)
    with skipped_where_it_cannot(), test.judged():
        return (yield)


@pytest.hookimpl(wrapper=True, tryfirst=True)
def pytest_runtest_makereport(
    item: pytest.Item, call: pytest.CallInfo[None]
) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Hook of pytest that completes the report of a test with data of its bench.

    If the bench blocked the test, the report becomes an error with the reason.
    """
    if (test := item.stash.get(BENCHED, None)) is None:
        report = yield
        if call.excinfo is not None and is_blocked(call.excinfo.value):
            verdict.make_error(report, verdict.blocked(report, call, None))
        return report
    mistaken = False
    if call.excinfo is not None:
        mistaken = verdict.is_mistake(call.excinfo.value)
        if not item.config.getoption("fulltrace", False):
            verdict.end_at_caller(call.excinfo.value)
    report = yield
    test.judge(report, call, mistaken=mistaken)
    return report


@pytest.hookimpl(tryfirst=True)
def pytest_pyfunc_call(pyfuncitem: pytest.Function) -> bool | None:
    """Hook of pytest that runs an async test in the time of its bench.

    Tests that another plug-in (such as pytest-asyncio) runs are left to that plug-in.
    """
    test = pyfuncitem.stash.get(BENCHED, None)
    if test is None or not iscoroutinefunction(pyfuncitem.obj):
        return None
    if any(pyfuncitem.get_closest_marker(name) for name in _OTHER_LOOPS):
        return None
    test.run_body(pyfuncitem)
    return True


# What is done before the first test, if anything was asked for.


def _prepare(config: pytest.Config, settings: PluginSettings) -> None:
    """Read the rig file, and register the plug-ins that the settings enable.

    Raises:
        pytest.UsageError: the rig file cannot be used, or options contradict each other.
    """
    if settings.rig_file and settings.ordered:
        with _usage():
            bench_source.plan_of(settings.rig_file)
    if settings.artifacts:
        try:
            whole_file.check_writable(settings.artifacts)
        except OSError as error:
            where = f"--bench-artifacts {settings.artifacts}"
            raise pytest.UsageError(f"{where}: {error.strerror}") from None
    for name, path in _PLUGINS.items():
        if getattr(settings, name):
            with _usage():
                plugin = resolve_name(path)(config, settings)
            config.pluginmanager.register(plugin, f"tickrig-bench-{name}")


@contextmanager
def _usage() -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise pytest.UsageError(f"{error.filename}: {error.strerror}") from None
    except ValueError as error:
        raise pytest.UsageError(str(error)) from None
