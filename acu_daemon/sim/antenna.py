"""SIMULATION of everything that moves and hears: axes, encoders, autotrack loop, receiver, under the sky.

Angles of the axes are those of the encoder, azimuth continuous; the beam points to encoder minus bias.  The
tilt axis moves, but does not turn the beam.
"""

from enum import Enum, auto
from math import cos, radians
from random import Random

from acu_daemon.model import AxisLimits
from acu_daemon.protocol.angles import elevation_code, elevation_deg
from acu_daemon.sim.autotrack import Autotrack
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.pedestal import STEP_S, Axis, Follower
from acu_daemon.sim.receiver import Offset, Receiver, ReceiverSettings, offset_in_beam
from acu_daemon.sim.registers import choose_turn
from acu_daemon.sim.sky import Direction

TILT = AxisLimits(-15.0, 15.0, 0.5, 0.5)
STOW_AZ_DEG = 0.0  # or the nearest limit; elevation: the upper one
STOW_BAND_DEG = 0.01
_LEAST_COS_EL = 0.01


class Drive(Enum):
    """What drives the axes."""

    HALT = auto()
    FOLLOW = auto()
    TRACK = auto()
    COAST = auto()
    STOW = auto()


class Antenna:
    """Each 50 Hz step: move_and_sense(), then one of halt(), follow(), track(), coast() and stow()."""

    def __init__(self, parts: AcuParts) -> None:
        scenario, choice = parts.scenario, parts.scenario.receiver
        self.az = Axis(parts.azimuth, scenario.acu.azimuth_deg)
        self.el = Axis(parts.elevation, scenario.acu.elevation_deg)
        self.tilt = Axis(TILT, 0.0)
        self.receiver = Receiver(
            ReceiverSettings(parts.beamwidth_deg, choice.peak_agc_db, choice.agc_noise_db, choice.tracking_noise_deg),
            Random(f"{parts.seed} receiver"),
            STEP_S,
        )
        self.direction: Direction | None = None
        self.offset: Offset | None = None
        self.has_signal = False
        self._sky = parts.sky
        self._encoder = scenario.encoder
        self._encoder_random = Random(f"{parts.seed} encoder")
        self._losses = [(*loss.window_tai_s(parts.start_tai_s), loss) for loss in scenario.losses]
        self._autotrack = Autotrack(self.az, self.el)
        self._follow_az, self._follow_el = Follower(parts.azimuth), Follower(parts.elevation)
        self._middle_az_deg = (parts.azimuth.min_deg + parts.azimuth.max_deg) / 2.0
        self._driven_by = Drive.HALT

    @property
    def is_sector_high(self) -> bool:
        """Whether the azimuth is in the high half of its range."""
        return self.az.angle_deg >= self._middle_az_deg

    @property
    def tilt_code(self) -> int:
        """Where the tilt axis is."""
        return elevation_code(self.tilt.angle_deg)

    @property
    def boresight_deg(self) -> tuple[float, float]:
        """True azimuth (continuous) and elevation of the beam."""
        return self.az.angle_deg - self._encoder.azimuth_bias_deg, self.el.angle_deg - self._encoder.elevation_bias_deg

    def reading_deg(self, part_s: float) -> tuple[float, float]:
        """Azimuth (continuous) and elevation as the encoders show them, with noise, part_s after the last step."""
        az_deg, el_deg = self.az.angle_after_deg(part_s), self.el.angle_after_deg(part_s)
        if noise_deg := self._encoder.noise_deg:
            gauss = self._encoder_random.gauss
            az_deg += gauss(0.0, noise_deg) / max(cos(radians(el_deg)), _LEAST_COS_EL)
            el_deg += gauss(0.0, noise_deg)
        return az_deg, el_deg

    def lose_power(self) -> None:
        """Everything stops where it is."""
        self.az.rate_deg_s = self.el.rate_deg_s = self.tilt.rate_deg_s = 0.0
        self.receiver.is_acquired = False
        self._driven_by = Drive.HALT

    def move_and_sense(self, tai_s: float, threshold_db: float) -> None:
        """Move the axes for one step and hear what is in the beam then."""
        self.az.move()
        self.el.move()
        self.tilt.move()
        fade_db, is_silent, is_connected = 0.0, False, True
        for start_s, end_s, loss in self._losses:
            if start_s <= tai_s < end_s:
                fade_db += loss.depth_db
                is_silent |= loss.cause == "silence-zone"
                is_connected &= loss.cause != "receiver"
        self.direction, self.offset = self._sky.direction(tai_s), None
        if self.direction is not None:
            self.offset = offset_in_beam(self.direction[0], self.direction[1], *self.boresight_deg)
        heard = None if is_silent else self.offset
        self.has_signal = heard is not None and is_connected
        self.receiver.is_valid = is_connected
        self.receiver.sense(None if heard is None else heard.angle_deg, fade_db, threshold_db)

    def _begins(self, drive: Drive) -> bool:
        begins = self._driven_by is not drive
        self._driven_by = drive
        return begins

    def halt(self) -> None:
        """Brake and stand."""
        self._driven_by = Drive.HALT
        self.az.halt()
        self.el.halt()
        self.tilt.halt()

    def follow(self, held: tuple[float, float, int], is_new: bool, sector_preference: int) -> None:
        """Follow the registers that were handed over, and that are new at this step or not."""
        begins = self._begins(Drive.FOLLOW)
        follow_az, follow_el = self._follow_az, self._follow_el
        if begins or is_new:
            az_deg = choose_turn(held[0], self.az.angle_deg, self.az.limits, sector_preference)
            if begins:
                follow_az.start(az_deg)
                follow_el.start(held[1])
            else:
                follow_az.aim(az_deg)
                follow_el.aim(held[1])
        else:
            follow_az.wait()
            follow_el.wait()
        self.az.drive_to(follow_az.target_deg, follow_az.rate_deg_s)
        self.el.drive_to(follow_el.target_deg, follow_el.rate_deg_s)
        self.tilt.drive_to(elevation_deg(held[2]), 0.0)

    def track(self, lowest_el_deg: float) -> None:
        """Drive by the error signal of the receiver; without a satellite the axes stand."""
        begins = self._begins(Drive.TRACK)
        if self.offset is None:
            self.halt()
            return
        measured = self.receiver.error_signal(self.offset)
        if begins:
            self._autotrack.start(measured)
        self._autotrack.drive(measured, lowest_el_deg)
        self.tilt.halt()

    def coast(self) -> None:
        """Go on at the rates that autotrack remembers."""
        self._driven_by = Drive.COAST
        self._autotrack.coast()
        self.tilt.halt()

    def stow(self) -> bool:
        """Drive to the stow position; whether it is reached."""
        self._driven_by = Drive.STOW
        az, el = self.az, self.el
        az_deg, el_deg = min(max(STOW_AZ_DEG, az.limits.min_deg), az.limits.max_deg), el.limits.max_deg
        az.drive_to(az_deg, 0.0)
        el.drive_to(el_deg, 0.0)
        self.tilt.halt()
        gap_deg = max(abs(az.angle_deg - az_deg), abs(el.angle_deg - el_deg))
        return gap_deg < STOW_BAND_DEG and not az.is_moving and not el.is_moving
