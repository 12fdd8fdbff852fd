"""How the station's sources of elements stand, in words: for `check`, `status` and `elements show`."""

from dataclasses import dataclass
from math import inf
from pathlib import Path

from acu_daemon.config.elements_tables import ElementsSourcesSection
from acu_daemon.edge.elements_choice import MOST_FILES, files_of
from acu_daemon.edge.fetch_policy import HOUR_S, FetchState, is_due
from acu_daemon.edge.fetch_state_file import read_fetch_state
from acu_daemon.edge.orbit_file import read_orbit_file
from acu_daemon.errors import AcuDaemonError
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import DAY_S

OLD_DAYS = 3.0  # without a good answer: warned of, however fresh the elements still are


@dataclass(frozen=True, slots=True)
class SourceStanding:
    """One source.  is_problem: somebody has to look."""

    source: str
    text: str
    is_problem: bool


def standings(config: Path, section: ElementsSourcesSection, now_tai_s: float) -> list[SourceStanding]:
    """How each source of a station.toml stands; directories are looked into."""
    return [
        *(url_standing(read_fetch_state(config / section.store, url), section, now_tai_s) for url in section.urls),
        *(_directory(config / one) for one in section.directories),
    ]


def fetch_problems(config: Path, section: ElementsSourcesSection, now_tai_s: float) -> str:
    """What is wrong with the URLs; empty: nothing."""
    found = [url_standing(read_fetch_state(config / section.store, url), section, now_tai_s) for url in section.urls]
    return "; ".join(f"{one.source}: {one.text}" for one in found if one.is_problem)


def url_standing(state: FetchState, section: ElementsSourcesSection, now_tai_s: float) -> SourceStanding:
    """How a URL stands, by what is written of it."""
    never = state.good_tai_s == -inf
    good = "never fetched yet" if never else f"last good answer {_ago(now_tai_s - state.good_tai_s)} ago"
    if state.stopped:
        return SourceStanding(
            state.url, f"STOPPED: {state.stopped}; nobody asks until `acu-daemon elements resume`; {good}", True
        )
    due = is_due(state, now_tai_s, section.every_h * HOUR_S)
    then = "asked next as soon as anybody fetches" if due else f"asked next at {utc_text(state.next_tai_s, 0)}"
    is_old = not never and now_tai_s - state.good_tai_s > max(OLD_DAYS * DAY_S, 3.0 * section.every_h * HOUR_S)
    problem = f"{state.problem} ({state.failed_count} times in a row); " if state.problem else ""
    return SourceStanding(state.url, f"{problem}{good}; {then}", is_old or bool(state.problem))


def _directory(path: Path) -> SourceStanding:
    if not path.is_dir():
        return SourceStanding(str(path), "no such directory: whoever fills it has not made it", True)
    files = files_of(path)
    bad = []
    for one in files:
        try:
            read_orbit_file(one)
        except (AcuDaemonError, OSError) as error:
            bad.append(str(error).splitlines()[0])
    if not files:
        return SourceStanding(str(path), "no file in it", True)
    count = f"{len(files)} files" if len(files) < MOST_FILES else f"the first {MOST_FILES} files"
    told = f"; left out: {'; '.join(bad[:3])}" + (f" and {len(bad) - 3} more" if len(bad) > 3 else "") if bad else ""
    return SourceStanding(str(path), count + told, bool(bad))


def _ago(seconds: float) -> str:
    return f"{seconds / DAY_S:.1f} days" if seconds > 2 * DAY_S else f"{max(seconds, 0.0) / HOUR_S:.1f} h"
