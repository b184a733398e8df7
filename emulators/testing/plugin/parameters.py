"""The plug-in of `--bench-param`: runs tests with each value of a named parameter."""

from __future__ import annotations

from collections.abc import Mapping

import pytest

from tickrig.emulators.testing.plugin.settings import SETTINGS, PluginSettings
from tickrig.host.text.names import near
from tickrig.host.text.values import parse_setting


class ParameterPlugin:
    """pytest plug-in for `--bench-param`: runs tests with each given value of a parameter.

    The values replace the fixture with the name of the parameter.

    Args:
        config: the configuration of pytest.
        settings: the settings of the plug-in.
    """

    def __init__(self, config: pytest.Config, settings: PluginSettings) -> None:
        self._parameters = settings.parameters
        self._taken: set[str] = set()
        self._names: dict[str, None] = {}

    def pytest_generate_tests(self, metafunc: pytest.Metafunc) -> None:
        """Hook of pytest: run a test with each value of its `--bench-param` parameters.

        Raises:
            Collector.CollectError: the test already has its own values for the parameter.
        """
        self._names.update(dict.fromkeys(metafunc.fixturenames))
        own = _own_names(metafunc)
        for name, words in self._parameters:
            if name not in metafunc.fixturenames:
                continue
            if name in own:
                where = metafunc.definition.name
                raise pytest.Collector.CollectError(
                    f"{where}: {name} has values of its own; make it a fixture that returns one"
                )
            self._taken.add(name)
            ids = [f"{name}={word}" for word in words]
            metafunc.parametrize(name, [parse_setting(word) for word in words], ids=ids)

    def pytest_collection_modifyitems(self, items: list[pytest.Item]) -> None:
        """Refuse a parameter that no test uses."""
        unknown = [one.name for one in self._parameters if one.name not in self._taken]
        if items and unknown:
            names = [name for name in self._names if not name.startswith(("bench", "request"))]
            raise pytest.UsageError(
                f"--bench-param {unknown[0]}: no test takes it; {near(unknown[0], names)}"
            )


def _own_names(metafunc: pytest.Metafunc) -> set[str]:
    """Return the names for which a test has values by its own markers."""
    names = set[str]()
    for marker in metafunc.definition.iter_markers("parametrize"):
        given = marker.args[0] if marker.args else marker.kwargs.get("argnames", "")
        listed = given.split(",") if isinstance(given, str) else given
        names.update(name.strip() for name in listed)
    return names


def words_of(item: pytest.Item) -> Mapping[str, str]:
    """Return the values of `--bench-param` with which a test runs, as written."""
    callspec = getattr(item, "callspec", None)
    if callspec is None:
        return {}
    return {
        name: words[callspec.indices[name]]
        for name, words in item.config.stash[SETTINGS].parameters
        if name in callspec.indices
    }
