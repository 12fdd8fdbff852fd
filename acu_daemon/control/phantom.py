"""A phantom pass: the whole of it flown before it, through plan, register limiter and permit, in virtual time.  Pure.

The antenna is led along the prediction (program track) by the daemon's own ticks on an ACU that obeys at once.  So what
limits, stops of the cable, zenith, sun, keep-out zones and mask cost is measured, not guessed, and a command that the
permit would keep back is found minutes before it matters.  Nothing is known of the signal here.
"""

import math
from collections.abc import Iterable
from dataclasses import asdict, dataclass, replace

from acu_daemon.acu.replies import AcuStatus
from acu_daemon.assist.session.prediction import predict
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.ideal_acu import IdealAcu
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import Exchange, Observation, PassPlan, Sky, TickInput
from acu_daemon.control.tracking.approach import longest_lead_s
from acu_daemon.control.tracking.hills import is_hidden
from acu_daemon.control.tracking.pass_plan import plan_pass
from acu_daemon.control.tracking.state_table import TrackState
from acu_daemon.model import Pass, Reading, Site, sky_angle_deg
from acu_daemon.orbit.propagator import Propagator
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.pointing.keyhole import KeyholeRules
from acu_daemon.pointing.outage import kept_out, sun_outages
from acu_daemon.pointing.reach import zenith_text

BEFORE_S, BEYOND_S = 2.0, 5.0  # what the buffer has beyond rise and set
SETTLE_S = 3.0  # after a crossing of the zenith
APART_S = 1.0  # two losses of one cause nearer than this are one


@dataclass(frozen=True, slots=True)
class LostSpan:
    """A time out of half the beam, and why."""

    from_tai_s: float
    to_tai_s: float
    why: str

    def __str__(self) -> str:
        return f"{self.to_tai_s - self.from_tai_s:.0f} s from {utc_text(self.from_tai_s, 0)[11:19]}: {self.why}"


@dataclass(frozen=True, slots=True)
class PhantomPass:
    """What was found.  up_s: above mask and lowest elevation; on_path_s: of these within half the beam of the path.

    told: what plan and sky say of the pass beforehand.  kept_back: commands that the permit did not let out.
    """

    up_s: float
    on_path_s: float
    largest_off_deg: float
    lost: tuple[LostSpan, ...] = ()
    told: tuple[str, ...] = ()
    kept_back: tuple[str, ...] = ()

    @property
    def no_go(self) -> str:
        """Why the pass is not worth beginning; empty: it is."""
        if self.kept_back:
            return f"phantom pass: the daemon's own commands are kept back: {self.kept_back[0]}"
        if self.up_s > 0.0 and self.on_path_s == 0.0:
            return f"phantom pass: the antenna is never on the path: {'; '.join(map(str, self.lost))}"
        return ""

    def __str__(self) -> str:
        said = f"on the path for {self.on_path_s:.0f} of {self.up_s:.0f} s"
        return "; ".join([said, *(f"lost {one}" for one in self.lost)])

    @property
    def record(self) -> dict[str, object]:
        """For the report of the pass."""
        return asdict(self) | {"lost": [asdict(one) for one in self.lost], "no_go": self.no_go, "words": str(self)}


def fly_phantom(
    propagator: Propagator,
    site: Site,
    coming: Pass,
    config: ControlConfig,
    keyhole: KeyholeRules | None,
    place: tuple[float, float],
) -> PhantomPass:
    """Fly a pass.  place: where the antenna stands, azimuth continuous; config: as of the run to come.

    Some seconds of work.  Raises: OrbitError: the elements have no answer for a time of the pass.
    """
    config = replace(
        config,
        has_signal=False,
        receiver=None,
        is_armed=True,
        is_shadow=False,
        is_resting=False,
        register_watchdog_s=0.0,
    )
    lead_s = longest_lead_s(config.azimuth, config.elevation, config.preposition_s)
    begin_tai_s = coming.rise_tai_s - lead_s - BEYOND_S
    plan = plan_pass(
        *(propagator, site, coming, place[0], config.azimuth, begin_tai_s), elevation=config.elevation, keyhole=keyhole
    )
    start_tai_s = coming.rise_tai_s - BEFORE_S
    prediction = predict(
        *(propagator, site, start_tai_s, coming.rise_tai_s, "TLE", plan.start_az_deg),
        horizon_s=coming.set_tai_s - start_tai_s + BEYOND_S,
        keyhole=keyhole,
        zenith_turn=plan.zenith_turn,
    )
    flown = _Flight(Sky(prediction, None, plan), config, IdealAcu(*place, config))
    for k in range(math.ceil((coming.set_tai_s - begin_tai_s) / config.period_s)):
        flown.tick(begin_tai_s + k * config.period_s)
    return PhantomPass(
        up_s=flown.up_s,
        on_path_s=flown.on_path_s,
        largest_off_deg=flown.largest_off_deg,
        lost=tuple(flown.lost),
        told=tuple(_told(propagator, site, coming, config, plan)),
        kept_back=tuple(flown.kept_back),
    )


class _Flight:
    """The daemon's decision and an ideal ACU, tick by tick."""

    def __init__(self, sky: Sky, config: ControlConfig, acu: IdealAcu) -> None:
        self._sky, self._config, self._acu = sky, config, acu
        self._state = ControlState()
        self._seen = Observation()
        self.up_s = self.on_path_s = self.largest_off_deg = 0.0
        self.lost: list[LostSpan] = []
        self.kept_back: list[str] = []

    def tick(self, now_tai_s: float) -> None:
        config = self._config
        self._acu.move(config.period_s)
        self._state, orders = tick(self._state, TickInput(self._seen, self._sky, now_tai_s), config)
        for event in orders.events:
            if event.name == "fence.refused":
                self._note_kept_back(f"{event.fields['command']}: {event.fields['reason']}")
        self._seen = Observation()
        for command in (orders.first, orders.extra):
            if command is None:
                continue
            reply = self._acu.answer(command)
            if isinstance(reply, AcuStatus):
                reading = Reading(now_tai_s + config.sample_delay_s, reply.az_deg, reply.el_deg, is_locked=False)
                self._seen = replace(self._seen, status=reply, reading=reading)
            else:
                self._seen = replace(self._seen, extra=Exchange(command, reply))
        self._judge(now_tai_s)

    def _note_kept_back(self, what: str) -> None:
        if len(self.kept_back) < 5 and what not in self.kept_back:
            self.kept_back.append(what)

    def _judge(self, now_tai_s: float) -> None:
        sky, config = self._sky, self._config
        if sky.plan is None or sky.prediction is None or now_tai_s < sky.plan.rise_tai_s:
            return
        path = sky.prediction.at(now_tai_s)
        if path is None or is_hidden(sky, now_tai_s, config):
            return
        off_deg = sky_angle_deg(self._acu.az.position_deg, self._acu.el.position_deg, path.az_deg, path.el_deg)
        self.up_s += config.period_s
        if off_deg <= config.beamwidth_deg / 2.0:
            self.on_path_s += config.period_s
            self.largest_off_deg = max(self.largest_off_deg, off_deg)
            return
        self._lose(now_tai_s, self._why(now_tai_s, sky.plan))

    def _why(self, now_tai_s: float, plan: PassPlan) -> str:
        state, crossing = self._state, self._sky.prediction.crossing if self._sky.prediction else None
        if state.refusals.limited:
            return state.refusals.limited
        if state.tracking.track is TrackState.AVOID:
            return "led clear of a keep-out"
        if crossing is not None and crossing.departure_tai_s <= now_tai_s <= crossing.return_tai_s + SETTLE_S:
            return "the azimuth drive cannot follow over the zenith"
        if any(one.tai_s <= now_tai_s <= one.tai_s + one.for_s + SETTLE_S for one in plan.unwindings):
            return "the cable is unwound"
        if state.tracking.track in (TrackState.PREPOSITION, TrackState.IDLE):
            return "the antenna is on its way to the path"
        return "the drives cannot follow"

    def _lose(self, now_tai_s: float, why: str) -> None:
        until_tai_s = now_tai_s + self._config.period_s
        last = self.lost[-1] if self.lost else None
        if last is not None and last.why == why and now_tai_s - last.to_tai_s < APART_S:
            self.lost[-1] = replace(last, to_tai_s=until_tai_s)
        else:
            self.lost.append(LostSpan(now_tai_s, until_tai_s, why))


def _told(propagator: Propagator, site: Site, coming: Pass, config: ControlConfig, plan: PassPlan) -> Iterable[str]:
    """What plan and sky say of the pass beforehand."""
    if plan.note:
        yield plan.note
    for change in plan.unwindings:
        yield f"the cable is unwound by {change.by_deg:.0f} deg at {utc_text(change.tai_s, 0)[11:19]}"
    if plan.crossing is not None:
        yield zenith_text(plan.crossing)
    yield from map(str, plan.beyond)
    yield from map(str, sun_outages(propagator, site, config.envelope.sun, coming))
    yield from map(str, kept_out(propagator, site, config.envelope.keep_outs, coming))
    for begin, end in coming.hidden_tai_s:
        yield f"behind the mask for {end - begin:.0f} s from {utc_text(begin, 0)[11:19]}"
