"""The decision of a tick with every option in use is the same in a mirror too: `test_mirrors` has those off by default.

Keep-outs, a sun that is avoided, a skyline, a receiver beside the ACU, the zenith led past, an
antenna held, nudged, slaved and stowed by people.
"""

from collections import Counter
from dataclasses import dataclass, replace
from functools import cache
from random import Random

import numpy as np
import pytest
from mirrors import Mirror
from test_mirrors import facts, lags, memory, same
from troubled_decision import START_TAI_S, TroubledDecision

from acu_daemon.control.orders import Orders
from acu_daemon.control.receiver_signal import SignalRules, SignalSample
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import (
    Asking,
    HoldWish,
    NudgeWish,
    Observation,
    Request,
    Sky,
    SlaveWish,
    StowBy,
    StowWish,
    TickInput,
)
from acu_daemon.model import ZenithCrossing
from acu_daemon.pointing.keep_out import Disc, KeepOut
from acu_daemon.pointing.skyline import skyline_of

SEEDS = (1, 2, 3, 5, 6, 7, 8, 10)
TICKS = 260
BY_SEED = (Mirror(az=-1, turned_deg=112.5), Mirror(el=-1, turned_deg=-45.0))  # even, with a skyline; odd
SEEN = {  # of events, that the runs are worth something
    *("signal.locked", "signal.lost", "hold.begins", "hold.ends", "nudge", "nudge.ends", "stow.begins", "stow.ends"),
    *("slaved.ends", "gate.limited", "axis.latched", "offset.refused", "encoder.frozen", "sector.wrong"),
}


@dataclass(frozen=True, eq=False)
class StillSun:
    """One that stands, so that a mirror can move it."""

    disc: Disc
    policy: str = "avoid"

    @property
    def radius_deg(self) -> float:
        return self.disc.radius_deg

    def at(self, _tai_s: float) -> Disc:
        return self.disc

    def angle_deg(self, az_deg: float, el_deg: float, _tai_s: float) -> float:
        return self.disc.clearance_deg(az_deg, el_deg) + self.disc.radius_deg

    def mirrored(self, mirror: Mirror) -> "StillSun":
        az_deg, el_deg = mirror.az_deg(self.disc.az_deg), mirror.el * self.disc.el_deg
        return StillSun(replace(self.disc, az_deg=az_deg, el_deg=el_deg), self.policy)


class EveryOption(TroubledDecision):
    """What else a file may ask for, and what people may."""

    def __post_init__(self) -> None:
        super().__post_init__()
        self.asked = Random(1000 + self.seed)
        draw, star = self.asked, self.star
        side = draw.choice((-1, 1))
        ahead_az_deg = star.az_deg + 20.0 * star.az_rate_deg_s + side * draw.uniform(8.0, 20.0)
        box = KeepOut("the mast", ahead_az_deg, ahead_az_deg + draw.uniform(4.0, 25.0), star.el_deg - 9.0, 90.0)
        sun = StillSun(Disc("the sun", star.az_deg - side * 15.0, star.el_deg + draw.uniform(-3.0, 3.0), 2.0))
        skyline = skyline_of(tuple((30.0 * k, draw.uniform(0.0, 60.0)) for k in range(12)))
        self.config = replace(
            self.config,
            envelope=replace(
                self.config.envelope,
                keep_outs=(box,) if self.seed % 3 else (),
                sun=sun if self.seed % 3 != 1 else None,
                skyline=skyline if self.has_skyline else None,
                stow_deg=(0.5 * (self.config.azimuth.min_deg + self.config.azimuth.max_deg) + 3.0, star.el_deg),
            ),
            leave_false_lock=True,
            false_lock_s=1.0,
            zenith_takeover=draw.choice(("always", "fitted")),
            has_signal=self.seed % 5 != 4,
            receiver=SignalRules(6.0, 4.0, 1.0),
        )

    @property
    def has_skyline(self) -> bool:
        return self.seed % 2 == 0

    def sky(self, now_s: float) -> Sky:
        sky = super().sky(now_s)
        assert sky.prediction is not None
        assert sky.plan is not None
        is_crossing = 14.0 < now_s < 17.0
        off_deg = 2.0 if 19.0 < now_s < 21.5 and sky.is_fitted else 0.0  # what autotrack holds is not the satellite
        crossing = ZenithCrossing(
            *(START_TAI_S + 15.0, START_TAI_S + 16.5, float(sky.prediction.az_deg[30]), 1.0, 99.0, 1.0, 1.0, None)
        )
        prediction = replace(
            sky.prediction,
            el_deg=sky.prediction.el_deg + off_deg,
            sigma_deg=np.full(sky.prediction.az_deg.size, 0.005),
            crossing=crossing if is_crossing else None,
        )
        hidden = ((START_TAI_S + 18.0, START_TAI_S + 20.0),)
        fit = None if sky.fit is None else replace(sky.fit, reading_count=200, along_s=0.5, across_deg=0.1)
        return Sky(prediction, fit, replace(sky.plan, hidden_tai_s=hidden))

    def _observe(self, now_s: float) -> Observation:
        seen = super()._observe(now_s)
        if seen.status is None or self.asked.random() > 0.025:
            return seen
        draw = self.asked
        asking: Asking = draw.choice(
            (
                HoldWish(),
                HoldWish(is_wanted=False),
                NudgeWish(draw.uniform(-2.0, 2.0), draw.uniform(-0.3, 0.3)),
                NudgeWish(0.0, 0.0),
                SlaveWish((self.star.az_deg + 5.0) % 360.0, self.star.el_deg - 2.0, 2.0, "another"),
                SlaveWish(None, None, 0.0, "another"),
                StowWish(StowBy.OPERATOR),
                StowWish(StowBy.OPERATOR, is_wanted=False),
                StowWish(StowBy.OPERATOR, is_wanted=False),
                Request.ARM,
            )
        )
        return replace(seen, requests=(*seen.requests, asking))

    def heard_beside(self, now_s: float) -> SignalSample | None:
        if self.asked.random() < 0.3:
            return None
        return SignalSample(START_TAI_S + now_s - 0.05, 7.0 if self.star.is_on else 3.0)


@cache
def run_of(seed: int) -> tuple[EveryOption, list[tuple[ControlState, Orders]]]:
    decision = EveryOption(seed)
    return decision, list(decision.run(TICKS))


@pytest.mark.long
@pytest.mark.parametrize("seed", SEEDS)
def test_the_mirrored_world_with_every_option_gets_the_mirrored_commands_and_the_same_events(seed: int) -> None:
    mirror = BY_SEED[seed % 2]  # what is above hills has no mirror below
    decision, ordered = run_of(seed)
    config, state = mirror.config(decision.config), ControlState()
    for k, (one, (plain, orders)) in enumerate(zip(decision.given, ordered, strict=True)):
        given = TickInput(mirror.seen(one.seen), mirror.sky(one.sky), one.now_tai_s, one.signal)
        state, of_mirror = tick(state, given, config)
        assert same(orders.first, of_mirror.first, mirror), (k, orders, of_mirror)
        assert same(orders.extra, of_mirror.extra, mirror), (k, orders, of_mirror)
        assert facts(orders) == facts(of_mirror), (k, orders, of_mirror)
        assert memory(plain) == memory(state), k
        assert (plain.false_lock, plain.stow, plain.receiver) == (state.false_lock, state.stow, state.receiver), k
        assert lags(state) == pytest.approx(lags(plain), rel=1e-3, abs=1e-4), k


def test_the_runs_go_through_all_options() -> None:
    runs = [run_of(seed) for seed in SEEDS]
    events = Counter(event.name for _, ordered in runs for _, orders in ordered for event in orders.events)
    assert not SEEN - set(events), events
    states = Counter(str(state.tracking.track) for _, ordered in runs for state, _ in ordered)
    assert {"AVOID", "ZENITH", "SLAVED", "PROGRAM", "STOW", "AUTOTRACK/TLE", "AUTOTRACK/FITTED"} <= set(states), states
