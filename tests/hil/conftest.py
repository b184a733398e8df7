"""Bodies in real time watch the wall clock: they run by themselves."""

from __future__ import annotations

import pytest


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    """Mark those in real time; of the manual's two ways the shorter one does there."""
    repeated = []
    for item in items:
        call = getattr(item, "callspec", None)
        if call is not None and call.params.get("bench_mode") == "real":
            item.add_marker(pytest.mark.realtime)
            if call.params.get("ready") == "plain":
                repeated.append(item)
    config.hook.pytest_deselected(items=repeated)
    items[:] = [item for item in items if item not in repeated]
