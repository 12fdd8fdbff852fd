"""What every test shares: where the real data lies, and the rule that no task may leak."""

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import pytest
import pytest_asyncio
from hypothesis import settings

SHARED = Path(__file__).resolve().parents[2] / "shared"
DATA = SHARED / "data"

# The same examples in every run, no matter how busy the machine: a test fails for the code's sake or not at all.
# New examples, kept in .hypothesis where one fails: pytest --hypothesis-profile=explore
settings.register_profile("same", deadline=None, derandomize=True, database=None)
settings.register_profile("explore", deadline=None, print_blob=True)
settings.load_profile("same")

needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the real data folder ../shared/data is not there")


@pytest_asyncio.fixture
async def _watched_tasks() -> AsyncIterator[None]:
    before = asyncio.all_tasks()
    yield
    left = [task for task in asyncio.all_tasks() - before if not task.done() and task is not asyncio.current_task()]
    for task in left:
        task.cancel()
    if left:
        pytest.fail(f"the test left tasks running: {[task.get_name() for task in left]}")


@pytest.fixture(autouse=True)
def _no_task_is_left_running(request: pytest.FixtureRequest) -> None:
    """Fail an asyncio test that leaves a task behind."""
    if request.node.get_closest_marker("asyncio"):
        request.getfixturevalue("_watched_tasks")
