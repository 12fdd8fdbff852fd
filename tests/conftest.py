"""What every test shares: where the real data lies, and the rule that no task may leak."""

import asyncio
import atexit
import os
import shutil
import signal
import tempfile
from collections.abc import AsyncIterator, Generator
from pathlib import Path
from typing import Any

import pytest
import pytest_asyncio
from hypothesis import settings
from machine_load import MachineLoad
from xdist.scheduler import LoadScopeScheduling

PROJECT = Path(__file__).resolve().parents[1]
SHARED = PROJECT.parent / "shared"
DATA = SHARED / "data"

os.umask(0o022)  # whatever the caller's is: it decides who may write the files of the tests
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the daemon has it; a test that loads numpy first would not
os.environ.setdefault("MPLCONFIGDIR", str(PROJECT / ".pytest_cache" / "matplotlib"))  # no cache in anybody's home

os.environ["XDG_RUNTIME_DIR"] = tempfile.mkdtemp(prefix="acu-daemon-")  # clocks of rehearsals: of these tests alone
atexit.register(shutil.rmtree, os.environ["XDG_RUNTIME_DIR"], ignore_errors=True)

for number in (signal.SIGINT, signal.SIGHUP, signal.SIGQUIT):  # which nohup and a shell's background have ignored,
    if signal.getsignal(number) is signal.SIG_IGN:  # and what the tests start would inherit that
        signal.signal(number, signal.default_int_handler if number == signal.SIGINT else lambda *_: None)

# The same examples in every run, no matter how busy the machine: a test fails for the code's sake or not at all.
# New examples, kept in .hypothesis where one fails: pytest --hypothesis-profile=explore
settings.register_profile("same", deadline=None, derandomize=True, database=None)
settings.register_profile("explore", deadline=None, print_blob=True)
settings.load_profile("same")

needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="the real data folder ../shared/data is not there")

STORIES = ("bench_pass", "crash", "disk_processes", "fault_processes", "install", "log_processes")


class WithStories(LoadScopeScheduling):
    """Deals out tests one by one, but all that ask about one story of real processes to the same worker."""

    def _split_scope(self, nodeid: str) -> str:
        name = Path(nodeid.split("::")[0]).stem.removeprefix("test_")
        return name if name in STORIES else nodeid


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> LoadScopeScheduling | None:
    """Take that one for `pytest --dist loadscope`."""
    return WithStories(config, log) if config.getvalue("dist") == "loadscope" else None


LOAD = MachineLoad()
NO_VERDICT = PROJECT / "build" / "no-verdict.txt"  # scripts/test runs them once more, alone


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_protocol(item: pytest.Item) -> None:
    """Watch the machine while real processes are tested."""
    if item.get_closest_marker("realtime"):
        LOAD.begin(str(item.path))


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    """Where a machine starves them, or stood still, the failure of real processes is no verdict: skipped and named."""
    report = yield
    is_asked = report.failed and item.get_closest_marker("realtime")
    if is_asked and (why := LOAD.why_no_verdict(str(item.path))):
        report.outcome, report.longrepr = "skipped", (str(item.path), item.location[1], f"no verdict: {why}")
        NO_VERDICT.parent.mkdir(exist_ok=True)
        with NO_VERDICT.open("a", encoding="utf-8") as names:
            names.write(f"{item.nodeid}\n")
    return report


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


@pytest.fixture(autouse=True)
def _written_files_are_whole(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> None:
    """What a test has written is whole: no bad file is looked at again for two seconds, but where that is the point."""
    if request.module.__name__ not in ("test_elements_file", "test_elements_come_late"):
        monkeypatch.setattr("acu_daemon.edge.elements_file.RECENT_S", -1.0)
