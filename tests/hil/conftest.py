"""Bodies in real time watch the wall clock: they run by themselves."""

from __future__ import annotations

import pytest


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    for item in items:
        call = getattr(item, "callspec", None)
        if call is not None and call.params.get("bench_mode") == "real":
            item.add_marker(pytest.mark.realtime)
