"""Campaigns: one function over many items, on all cores of this machine or on a dask cluster, with a progress bar.

The function and the items must be picklable: a function at the top of a module, or a `functools.partial` of one.
Randomness comes in with the item (`numpy.random.SeedSequence(seed).spawn(n)`), so that a result depends on neither the
number of processes nor their order.
"""

import sys
import traceback
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass
from importlib import import_module
from typing import Any, TypeVar

import joblib

from acu_daemon.edge.rich_loading import let_rich_load
from acu_daemon.errors import AcuDaemonError, CampaignError, UsageError

CONNECT_S = 10.0
_SHOWN_FAILURES = 5

Item = TypeVar("Item")
Result = TypeVar("Result")
OnDone = Callable[[int, int], None]  # takes how many items are done, and how many there are


@dataclass(frozen=True, slots=True)
class Failed:
    """What takes the place of a result where an item's run ended by an error; the others go on."""

    item: str
    reason: str  # the message of an error of ours, the traceback of any other

    def __str__(self) -> str:
        return f"{self.item}: {self.reason}"


def run_campaign(
    work: Callable[[Item], Result],
    items: Sequence[Item],
    *,
    jobs: int | None = None,
    dask: str | None = None,
    name_of: Callable[[Item], str] = str,
    on_done: OnDone | None = None,
) -> list[Result | Failed]:
    """Run `work` on every item; the results stand in the order of the items.

    Args:    jobs: processes, None for one a core; 1 runs everything in this process.
             dask: address of a dask scheduler such as "tcp://host:8786", on whose workers it runs instead.
             name_of: what a failure calls its item.
    Raises:  UsageError: no such cluster, or the extra `cluster` is not installed.
    """
    if jobs is not None and jobs < 1:
        raise UsageError(f"--jobs {jobs}: expected 1 or more processes")
    outcomes: list[Any] = [None] * len(items)
    with _backend(dask):
        parallel = joblib.Parallel(n_jobs=-1 if jobs is None else jobs, return_as="generator_unordered", batch_size=1)
        tasks = (joblib.delayed(_run_one)(work, index, item, name_of(item)) for index, item in enumerate(items))
        for count, (index, outcome) in enumerate(parallel(tasks), start=1):
            outcomes[index] = outcome
            if on_done is not None:
                on_done(count, len(items))
    return outcomes


def results_of(outcomes: Sequence[Result | Failed]) -> list[Result]:
    """All results, where every item has one.  Raises: CampaignError: names the items that failed, and why."""
    failures = [one for one in outcomes if isinstance(one, Failed)]
    if failures:
        more = len(failures) - _SHOWN_FAILURES
        shown = [str(one) for one in failures[:_SHOWN_FAILURES]] + ([f"and {more} more"] if more > 0 else [])
        raise CampaignError("\n".join([f"{len(failures)} of {len(outcomes)} runs failed:", *shown]))
    return [one for one in outcomes if not isinstance(one, Failed)]


@contextmanager
def progress_bar(what: str) -> Iterator[OnDone | None]:
    """A bar on stderr with the time left, for `on_done`; nothing where stderr is no terminal."""
    if not sys.stderr.isatty():
        yield None
        return
    let_rich_load()
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda count, total: bar.update(task, completed=count, total=total)


def _run_one(work: Callable[[Item], Result], index: int, item: Item, name: str) -> tuple[int, Result | Failed]:
    try:
        return index, work(item)
    except AcuDaemonError as error:
        return index, Failed(name, str(error))
    except Exception:  # noqa: BLE001  the top of a worker: the other items go on, and this one's reason is told
        return index, Failed(name, traceback.format_exc())


def _backend(dask: str | None) -> AbstractContextManager[Any]:
    return nullcontext() if dask is None else _cluster(dask)


@contextmanager
def _cluster(address: str) -> Iterator[None]:
    try:
        client_of: Any = import_module("distributed").Client
    except ImportError:
        raise UsageError(
            f"--dask {address} needs dask: pip install 'acu-daemon[cluster]', here and on every worker"
        ) from None
    try:
        client = client_of(address, timeout=CONNECT_S, set_as_default=True)
    except (OSError, ValueError) as error:
        raise UsageError(
            f"--dask {address}: no dask scheduler answers there ({error}); start one with `dask scheduler`, and on "
            "every machine `dask worker ADDRESS` where this acu-daemon is installed"
        ) from None
    with client, joblib.parallel_config(backend="dask", wait_for_workers_timeout=CONNECT_S):
        yield
