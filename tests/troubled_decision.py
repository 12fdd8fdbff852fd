"""A tick against the fake ACU with one trouble after the other, by chance: what the tick was given, to give it again.

Nothing but `tick` and the simulated ACU: no loop, no link.  A trouble changes what the tick sees, or what the ACU does.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from random import Random

import numpy as np
from fake_sky import START_TAI_S, Star

from acu_daemon.acu.commands import AcuMode, Command, SelectMode, Stop
from acu_daemon.acu.replies import AcuStatus, Refused, Reply
from acu_daemon.control.control_config import ControlConfig
from acu_daemon.control.orders import Orders
from acu_daemon.control.receiver_signal import SignalSample
from acu_daemon.control.state import ControlState
from acu_daemon.control.tick import tick
from acu_daemon.control.tick_input import Exchange, Observation, PassPlan, Request, Sky, TickInput
from acu_daemon.drivers.sa3842.messages import Stow
from acu_daemon.drivers.sa3842.sa3842_driver import field_reply, wire_command
from acu_daemon.model import AxisLimits, Correction, FitResult, Model, Prediction, Reading
from acu_daemon.pointing.envelope import Envelope
from acu_daemon.sim.acu import FakeAcu
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.scenario import AcuChoice, Encoder, Scenario
from acu_daemon.sim.sky import Direction
from acu_daemon.units import Array

PERIOD_S = 0.1
RISE_S, PASS_S = 4.0, 400.0
AXIS_AFTER_S = 1.0  # of a loss an axis fails
AZIMUTHS = (
    AxisLimits(-270.0, 270.0, 20.0, 10.0),
    AxisLimits(-200.0, 320.0, 8.0, 3.0),
    AxisLimits(-170.0, 170.0, 20.0, 10.0),
)
ELEVATIONS = (AxisLimits(0.0, 90.0, 5.0, 5.0), AxisLimits(8.0, 60.0, 4.0, 2.0))
TROUBLES = (
    *("nothing", "loss", "loss", "long loss", "freeze az", "freeze el", "run az", "run el", "jump az", "jump el"),
    *("silence", "nak", "late", "sector", "stop", "standby", "stow", "local", "fault", "bits", "no room", "not finite"),
    *("az code", "el code"),
)
FLAGS = ("is_at_cw_limit", "is_at_ccw_limit", "is_at_up_limit", "is_at_down_limit", "is_sector_high", "is_acquired")


@dataclass
class Swing(Star):
    """A star that speeds up and slows down, both ways."""

    az_swing_deg: float = 0.0
    el_swing_deg: float = 0.0
    swing_rad_s: float = 0.5

    def place(self, t: Array) -> tuple[Array, Array, Array, Array]:
        """Azimuth, continuous, elevation, and their rates at seconds."""
        w, turned, slope = self.swing_rad_s, np.sin(self.swing_rad_s * t), np.cos(self.swing_rad_s * t)
        return (
            self.az_deg + self.az_rate_deg_s * t + self.az_swing_deg * turned,
            self.el_deg + self.el_rate_deg_s * t + self.el_swing_deg * turned,
            self.az_rate_deg_s + self.az_swing_deg * w * slope,
            self.el_rate_deg_s + self.el_swing_deg * w * slope,
        )

    def direction(self, tai_s: float) -> Direction | None:
        if not self.is_on:
            return None
        az_deg, el_deg, _, _ = self.place(np.array([tai_s - START_TAI_S]))
        return float(az_deg[0]) % 360.0, float(el_deg[0]), 1e6


@dataclass
class Trouble:
    """One at a time."""

    kind: str = "nothing"
    until_s: float = 7.0
    sign: int = 1
    begun_s: float = 0.0
    held: AcuStatus | None = None


@dataclass
class TroubledDecision:
    """One daemon's decision and one ACU; everything of it follows from the seed."""

    seed: int
    random: Random = field(init=False)
    given: list[TickInput] = field(init=False, default_factory=list)

    def __post_init__(self) -> None:
        self.random = Random(self.seed)
        draw = self.random
        self.config = ControlConfig(
            Envelope(draw.choice(AZIMUTHS), draw.choice(ELEVATIONS)),
            min_elevation_deg=-90.0,
            preposition_s=10.0,
            acquire_s=3.0,
            hold_s=5.0,
            search_s=20.0,
            search_along_s=4.0,
            search_across_deg=0.3,  # the row on the path alone: of rows beside it the right one comes first
            register_watchdog_s=draw.choice((0.0, 2.0)),
        )
        azimuth, elevation = self.config.azimuth, self.config.elevation
        sign_az, sign_el = draw.choice((-1, 1)), draw.choice((-1, 1))
        az_deg = draw.uniform(azimuth.min_deg + 40.0, azimuth.max_deg - 40.0)
        el_deg = draw.uniform(15.0, 80.0) if elevation.max_deg > 80.0 else draw.uniform(15.0, 55.0)
        self.star = Swing(az_deg, el_deg, sign_az * draw.uniform(0.2, 3.0), sign_el * draw.uniform(0.05, 0.5))
        if self.seed % 2:
            self.star = Swing(az_deg, el_deg, 0.0, 0.0, True, sign_az * draw.uniform(5.0, 15.0), sign_el * 5.0)
        away_deg, bit = draw.choice((0.1, 5.0, 30.0)) * draw.choice((-1, 1)), "driven"
        if self.seed % 4 == 0 and azimuth.max_deg - azimuth.min_deg > 400.0:  # where two turns have the bearing
            from_end_deg, is_low = draw.uniform(20.0, azimuth.max_deg - azimuth.min_deg - 380.0), sign_az > 0
            stands_deg = azimuth.min_deg + from_end_deg if is_low else azimuth.max_deg - from_end_deg
            away_deg, bit = stands_deg - az_deg, "stuck-1" if is_low else "stuck-0"
        antenna = AcuChoice(
            azimuth_deg=min(max(az_deg + away_deg, azimuth.min_deg), azimuth.max_deg),
            elevation_deg=el_deg,
            sector_bit=bit,
        )
        scenario = Scenario(acu=antenna, encoder=Encoder(noise_deg=draw.choice((0.0, 0.003))))
        self.acu = FakeAcu(AcuParts(azimuth, elevation, 1.0, self.star, START_TAI_S, scenario, self.seed))
        self.late_s, self.aside_deg = draw.uniform(-0.6, 0.6), draw.uniform(-0.2, 0.2)
        self.state = ControlState()
        self.orders = Orders(SelectMode(AcuMode.STANDBY))
        self.trouble = Trouble()
        self.silence_s = 0.0

    def sky(self, now_s: float) -> Sky:
        """The star's path, late and aside; a fit that is right comes later, and may go."""
        has_fit = 10.0 < now_s < 24.0 and self.seed % 3 != 0
        late_s, aside_deg = (0.0, 0.0) if has_fit else (self.late_s, self.aside_deg)
        start_s = now_s - 15.0
        t = start_s + 0.5 * np.arange(80) - late_s
        az_deg, el_deg, az_rate, el_rate = self.star.place(t)
        az_deg += aside_deg
        if self.trouble.kind == "not finite":
            el_deg[:] = np.nan
        prediction = Prediction(
            START_TAI_S + start_s,
            0.5,
            *(az_deg, el_deg, az_rate, el_rate, az_deg, az_rate),
            kind="FITTED" if has_fit else "TLE",
            made_at_tai_s=START_TAI_S + now_s,
            model=Model.NEW_FIT if has_fit else Model.ELEMENTS,
            spread=(0.5, 0.05),
            late_drift_deg_s=np.full((2, t.size), 0.002),
        )
        plan = PassPlan(*(START_TAI_S + one for one in (RISE_S, PASS_S, RISE_S)), float(az_deg[38]), float(el_deg[38]))
        return Sky(prediction, FitResult("full", Correction(), 0.0, 1, 0, 0.0, 0.1, 0.1) if has_fit else None, plan)

    def heard_beside(self, now_s: float) -> SignalSample | None:
        """What a receiver beside the ACU says."""
        return None

    def run(self, count: int) -> Iterator[tuple[ControlState, Orders]]:
        """Tick; what each was given is in `given`."""
        for k in range(count):
            now_s = PERIOD_S * (k + 1) + (0.02 * self.random.random() if self.random.random() < 0.05 else 0.0)
            self._next_trouble(now_s)
            one = TickInput(self._observe(now_s), self.sky(now_s), START_TAI_S + now_s, self.heard_beside(now_s))
            self.given.append(one)
            self.state, self.orders = tick(self.state, one, self.config)
            yield self.state, self.orders

    def _next_trouble(self, now_s: float) -> None:
        if now_s < self.trouble.until_s:
            return
        was, draw = self.trouble.kind, self.random
        kind = draw.choice(TROUBLES) if was == "nothing" else "nothing"
        kind = TROUBLES[self.seed % len(TROUBLES)] if self.trouble.begun_s == 0.0 else kind
        is_of_axis = kind.endswith((" az", " el"))  # while it follows its registers, in a loss
        lasts_s = {"nothing": 2.5, "long loss": 12.0, "loss": 4.0}.get(kind, draw.choice((0.3, 1.0, 3.5)))
        lasts_s = 5.0 if is_of_axis else lasts_s
        self.trouble = Trouble(kind, now_s + lasts_s, draw.choice((-1, 1)), now_s)
        self.star.is_on = not (is_of_axis or "loss" in kind)
        tai_s = START_TAI_S + now_s - 0.05
        if "local" in (kind, was):
            self.acu.set_local(kind == "local", tai_s)
        if kind in ("stop", "standby", "stow"):
            self.acu.answer({"stop": Stop(), "standby": SelectMode(AcuMode.STANDBY), "stow": Stow()}[kind])
        if was == "stow":
            self.acu.answer(SelectMode(AcuMode.STANDBY))
        if "fault" in (kind, was):
            (self.acu.begin_fault if kind == "fault" else self.acu.end_fault)("azimuth", 0, tai_s)

    def _observe(self, now_s: float) -> Observation:
        """Send what was ordered a tick ago, and see what comes back."""
        self.acu.advance(START_TAI_S + now_s - PERIOD_S + 0.02)
        reply, extra, kind = self._answer(self.orders.first), None, self.trouble.kind
        if self.orders.extra is not None:
            extra = Exchange(self.orders.extra, self._answer(self.orders.extra))
        if kind == "silence" or not isinstance(reply, AcuStatus | Refused):
            self.silence_s = self.silence_s + PERIOD_S if kind == "silence" else 0.0
            extra = None if kind == "silence" else Exchange(self.orders.first, reply)
            return Observation(extra=extra, silence_s=self.silence_s, must_poll=kind == "silence")
        self.silence_s = 0.0
        requests = (Request.ARM, Request.CLEAR) if self.random.random() < 0.05 else ()
        if kind == "nak" or isinstance(reply, Refused):
            return Observation(extra=extra, refused=Refused(), requests=requests)
        status = self._troubled(reply, now_s)
        reading = Reading(START_TAI_S + now_s - PERIOD_S + 0.01, status.az_deg, status.el_deg, status.is_acquired)
        in_step, room = kind != "late", kind != "no room"
        return Observation(reading, status, is_in_step=in_step, extra=extra, requests=requests, has_room=room)

    def _answer(self, command: Command) -> Reply:
        return field_reply(self.acu.answer(wire_command(command)))

    def _troubled(self, status: AcuStatus, now_s: float) -> AcuStatus:
        trouble, since_s = self.trouble, now_s - self.trouble.begun_s - AXIS_AFTER_S
        if since_s < 0.0 and trouble.kind.endswith((" az", " el")):
            return status
        trouble.held = trouble.held or status
        match trouble.kind:
            case "freeze az" | "az code":
                return replace(status, az_deg=trouble.held.az_deg)
            case "freeze el" | "el code":
                return replace(status, el_deg=trouble.held.el_deg)
            case "run az":
                return replace(status, az_deg=_code(status.az_deg + trouble.sign * 6.0 * since_s) % 360.0)
            case "run el":
                return replace(status, el_deg=_code(status.el_deg + trouble.sign * 3.0 * since_s))
            case "jump az":
                return replace(status, az_deg=_code(status.az_deg + trouble.sign * 30.0) % 360.0)
            case "jump el":
                return replace(status, el_deg=_code(status.el_deg + trouble.sign * 12.0))
            case "sector":
                return replace(status, is_sector_high=not status.is_sector_high)
            case "bits" if self.random.random() < 0.5:
                flag = self.random.choice(FLAGS)
                return replace(status, **{flag: not getattr(status, flag)})
        return status


def _code(angle_deg: float) -> float:
    """As the wire carries it."""
    return round(angle_deg * 65536.0 / 360.0) * 360.0 / 65536.0
