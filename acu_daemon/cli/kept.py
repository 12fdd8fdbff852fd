"""What a run finds in the state directory, and what it leaves there for a restart and for the next pass."""

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import structlog

from acu_daemon.assist.estimators.estimator import has_covariance
from acu_daemon.assist.estimators.full.carry_over import (
    CarryOver,
    carry_over_of,
    resume_of,
    why_not,
    why_not_resume,
    why_other_frame,
)
from acu_daemon.assist.mount_memory.pedestal_memory import PedestalMemory
from acu_daemon.cli.options import Target
from acu_daemon.config.to_settings import estimator_settings, pedestal_text
from acu_daemon.control.state import ControlState, Held, remembered
from acu_daemon.control.tick_input import StowBy
from acu_daemon.edge.carry_over_file import FitKeeper, carry_over_path, read_carry_over
from acu_daemon.edge.clock import Clock
from acu_daemon.edge.latch import DISARMED, LATCH, STOWED, LatchKeeper, read_latch
from acu_daemon.edge.mount_memory_file import MOUNT, MountKeeper, mount_files, open_mount_file
from acu_daemon.edge.run_state import RUN_STATE, RunState, RunStateKeeper, read_run_state
from acu_daemon.edge.writer import Writer
from acu_daemon.model import FitResult, Pass


@dataclass(frozen=True, slots=True)
class Kept:
    """What was left, and the six that keep what this run leaves.

    carried: the fit of this pass, where the daemon is started again in it, else what the last pass left.
    memory: what the station knows of its antenna, from passes of any satellite.
    state: what the decision begins with.  A latch, a disarm and a stow stay until they are ended, whatever the pass;
    what a person armed is armed for one pass.
    """

    carried: CarryOver | None
    memory: PedestalMemory
    state: ControlState
    carry_over: FitKeeper
    mount: MountKeeper
    run_state: RunStateKeeper
    latches: LatchKeeper
    disarms: LatchKeeper
    stows: LatchKeeper

    def offer(self, fit: FitResult) -> None:
        """Take an accepted fit."""
        self.carry_over.offer(fit)
        self.run_state.offer(fit)

    def see(self, state: ControlState) -> None:
        """Take the memory of a tick."""
        self.latches.see(state.latch.problem)
        self.disarms.see(state.arming.disarmed_by)
        self.stows.see(str(state.stow.stow_by))
        self.run_state.see(state)

    @property
    def problem(self) -> str:
        """What of it cannot be written now, and why; "": all is."""
        keepers = (self.run_state, self.carry_over, self.mount, self.latches, self.disarms, self.stows)
        return "; ".join(keeper.problem for keeper in keepers if keeper.problem)

    def flush(self) -> None:
        """Save what is not saved yet."""
        self.carry_over.flush()


def open_kept(
    directory: Path,
    target: Target,
    coming: Pass | None,
    clock: Clock,
    files: Writer,
    older: Sequence[Path] = (),
) -> Kept:
    """Read what was left; say in the log what of it is used.  older: other folders of the same antenna.

    coming None: no pass is on; then of the last one it counts whether the daemon still holds the antenna.
    """
    source, site, now_tai_s = target.elements.propagator, target.station.site, clock.tai_s()
    clock_s = now_tai_s - clock.monotonic_s() if clock.is_rehearsal else None
    left = read_run_state(_first_with(RUN_STATE, directory, older))
    is_another = left.is_of_another_rehearsal(clock_s)
    latch, disarmed_by, stowed = (
        "" if is_another else read_latch(directory, name, older) for name in (LATCH, DISARMED, STOWED)
    )
    stow_by = _stow_by(stowed, left)
    is_same_pass = coming is not None and left.is_of(target.elements.label, coming, clock_s)
    if coming is None and not is_another:
        state = _first_state(RunState(held=left.held), latch, disarmed_by, stow_by)
    else:
        of_pass = replace(left, by_hand=left.by_hand_with(target.elements.about)) if is_same_pass else RunState()
        state = _first_state(of_pass, latch, disarmed_by, stow_by)
    resumed = _resumed(left, target, now_tai_s) if is_same_pass else None
    path = carry_over_path(directory, target.satellite.satellite.norad_id, target.satellite.satellite.name)
    from_path = _first_with(path.name, directory, older) / path.name
    mount = open_mount_file(
        next(iter(mount_files(directory, older)), directory / MOUNT),
        pedestal_text(target.station),
        estimator_settings(target.station, target.satellite),
        target.elements.label,
        coming.rise_tai_s if coming else 0.0,
        now_tai_s,
    )
    if mount.memory.pass_count:
        structlog.get_logger("mount").info("mount.used", passes=mount.memory.pass_count, terms=mount.memory.has_mount)
    first = RunState(
        satellite=target.elements.label if coming else "",
        rise_tai_s=coming.rise_tai_s if coming else 0.0,
        set_tai_s=coming.set_tai_s if coming else 0.0,
        clock_s=clock_s,
        arming=state.arming.by_people,
        fit=resumed,
        by_hand=state.by_hand,
        elements=target.elements.about,
    )
    return Kept(
        carried=resumed or _carried(target, from_path, now_tai_s),
        memory=mount.memory,
        state=state,
        carry_over=FitKeeper(path, target.elements.label, partial(carry_over_of, source=source, site=site), files),
        mount=MountKeeper(directory / MOUNT, mount, files),
        run_state=RunStateKeeper(directory, files, first, partial(resume_of, source=source, site=site)),
        latches=LatchKeeper(directory, files, latch, clock, LATCH, older, is_left_out=is_another),
        disarms=LatchKeeper(directory, files, disarmed_by, clock, DISARMED, older, is_left_out=is_another),
        stows=LatchKeeper(directory, files, stowed, clock, STOWED, older, is_left_out=is_another),
    )


def _first_with(name: str, directory: Path, older: Sequence[Path]) -> Path:
    """The antenna's own folder where it has the file, or where no older one has it either."""
    return next((one for one in (directory, *older) if os.path.lexists(one / name)), directory)


def _stow_by(stowed: str, left: RunState) -> StowBy:
    """Whose stow the file tells; one that cannot be read counts as a person's."""
    if not stowed:
        return StowBy.PANEL if left.is_stow_kept else StowBy.NOBODY
    return StowBy(stowed) if stowed in set(StowBy) else StowBy.OPERATOR


def _first_state(left: RunState, latch: str, disarmed_by: str, stow_by: StowBy) -> ControlState:
    """What the decision begins with; left: of this pass."""
    is_disarmed = bool(disarmed_by) or left.arming is False
    return remembered(
        by_people=False if is_disarmed else left.arming,
        disarmed_by=disarmed_by or ("a person, before the restart" if is_disarmed else ""),
        is_stop_due=left.held is not None if is_disarmed else bool(latch),  # disarmed it is held until STOP
        latch=latch,
        held=None if left.held is None else Held(left.held),
        stow_by=stow_by,
        by_hand=left.by_hand,
    )


def _resumed(left: RunState, target: Target, now_tai_s: float) -> CarryOver | None:
    """The fit of this pass, where it can be gone on from."""
    log: Any = structlog.get_logger("run_state")
    if left.fit is None:
        return None
    station = target.station
    reason = why_not_resume(
        left.fit,
        target.elements.propagator,
        station.site,
        station.tracking.estimator,
        estimator_settings(station, target.satellite),
        now_tai_s,
        has_covariance=has_covariance(station.tracking.estimator),
    )
    if reason:
        log.warning("run_state.dropped", reason=reason)
        return None
    log.info("run.resumed", state=left.track, fit_age_s=round(now_tai_s - left.fit.at_tai_s, 1))
    return left.fit


def _carried(target: Target, path: Path, now_tai_s: float) -> CarryOver | None:
    """What the last pass of the satellite left, where it may be used."""
    carried = (
        read_carry_over(path, target.elements.label) if has_covariance(target.station.tracking.estimator) else None
    )
    if carried is None:
        return None
    log: Any = structlog.get_logger("carry_over")
    settings = estimator_settings(target.station, target.satellite)
    reason = why_other_frame(carried, target.station.site) or why_not(
        carried, target.elements.propagator, settings, now_tai_s
    )
    if reason:
        log.warning("carry_over.dropped", reason=reason, file=str(path))
        return None
    parts = "orbit and biases" if carried.station == target.station.site.station else "orbit"
    log.info("carry_over.used", age_h=round((now_tai_s - carried.at_tai_s) / 3600.0, 2), of=parts)
    return carried
