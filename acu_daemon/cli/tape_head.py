"""The head of a tape: all that a pass is decided with, and the job that is made of it again."""

from dataclasses import asdict, dataclass, replace
from datetime import date
from typing import Any

from acu_daemon import __version__
from acu_daemon.cli.options import Target
from acu_daemon.cli.run_setup import make_job
from acu_daemon.config.stored import satellite_of, satellite_text, station_of, station_text
from acu_daemon.control.state import Held, remembered
from acu_daemon.control.tick_input import StowBy
from acu_daemon.daemon.service import PassJob
from acu_daemon.edge import carry_over_file, mount_memory_file
from acu_daemon.edge.elements_file import LoadedElements
from acu_daemon.edge.mount_memory_file import MountFile
from acu_daemon.edge.run_state import by_hand_json, by_hand_of
from acu_daemon.edge.stored_orbit import orbit_json, orbit_of
from acu_daemon.errors import AcuDaemonError, UsageError
from acu_daemon.model import Pass
from acu_daemon.orbit.timescales import adopt_leap_dates, leap_dates, utc_text


@dataclass(frozen=True, slots=True)
class TapedLine:
    """What of a link its bytes do not say."""

    description: str
    byte_time_s: float


@dataclass(frozen=True, slots=True)
class TapedPass:
    """What a tape's head says.  begun_tai_s: of the run."""

    target: Target
    job: PassJob
    begun_tai_s: float
    link: str
    version: str


def head_of(target: Target, job: PassJob, link: Any, begun_tai_s: float) -> dict[str, Any]:
    """The head for a run that is about to begin.  link: what is open to the ACU."""
    state, refit = job.state, job.refit
    held = state.foreign_stop.held
    memory = None if refit.memory is None else MountFile("", refit.memory, (), "", 0.0)
    return {
        "version": __version__,
        "begun_utc": utc_text(begun_tai_s),
        "begun_tai_s": begun_tai_s,
        "station": station_text(target.station),
        "satellite": satellite_text(target.satellite),
        "orbit": orbit_json(refit.propagator),
        "label": target.elements.label,
        "coming": None if job.coming is None else asdict(job.coming),
        "link": link.description,
        "byte_time_s": link.byte_time_s,
        "is_rehearsal": job.is_rehearsal,
        "is_shadow": job.control.is_shadow,
        "is_resting": job.control.is_resting,
        "state": {
            "by_people": state.arming.by_people,
            "disarmed_by": state.arming.disarmed_by,
            "is_stop_due": state.arming.is_stop_due,
            "latch": state.latch.problem,
            "held": None if held is None else asdict(held),
            "stow_by": str(state.stow.stow_by),
            "by_hand": by_hand_json(state.by_hand),
        },
        "carried": None if refit.carried is None else carry_over_file.to_json("", refit.carried),
        "is_resumed": refit.is_resumed,
        "memory": None if memory is None else mount_memory_file.to_json(memory),
        "leap_dates": [one.isoformat() for one in leap_dates()],
    }


def taped_pass(head: dict[str, Any], where: str) -> TapedPass:
    """The pass of a tape, as it began.  UsageError: its head cannot be used, and why."""
    try:
        return _taped_pass(head)
    except (ValueError, TypeError, KeyError, AcuDaemonError) as error:
        raise UsageError(f"{where}: the head of the tape cannot be used: {carry_over_file.reason_of(error)}") from None


def _taped_pass(head: dict[str, Any]) -> TapedPass:
    dates = [date.fromisoformat(one) for one in head["leap_dates"]]
    if len(dates) > len(leap_dates()):
        adopt_leap_dates(dates)
    station, satellite = station_of(head["station"]), satellite_of(head["satellite"])
    source = orbit_of(head["orbit"], station.site.orientation)
    elements = LoadedElements(source, head["label"], source.epoch_tai_s, [], [])
    target = Target(station, satellite, elements)
    coming = head["coming"]
    if coming is not None:
        hidden = tuple((begin, end) for begin, end in coming["hidden_tai_s"])
        coming = Pass(**{**coming, "hidden_tai_s": hidden})
    carried, memory, left = head["carried"], head["memory"], head["state"]
    if carried is not None:
        carried = replace(carry_over_file.from_json(carried, ""), is_of_this_pass=head["is_resumed"])
    job = make_job(
        target,
        coming,
        TapedLine(head["link"], head["byte_time_s"]),
        is_rehearsal=head["is_rehearsal"],
        carried=carried,
        memory=None if memory is None else mount_memory_file.from_json(memory).memory,
    )
    control = replace(job.control, is_shadow=head["is_shadow"], is_resting=head["is_resting"])
    held = None if left["held"] is None else Held(**left["held"])
    by_hand = by_hand_of(left.get("by_hand"))
    state = remembered(**{**left, "held": held, "stow_by": StowBy(left["stow_by"]), "by_hand": by_hand})
    return TapedPass(
        target, replace(job, control=control, state=state), head["begun_tai_s"], head["link"], head["version"]
    )
