import pytest
from rigs.processes.planning_children import Children


@pytest.fixture
def children(monkeypatch: pytest.MonkeyPatch) -> Children:
    return Children(monkeypatch)
