"""SIMULATION of everything that moves and hears: axes, encoders, autotrack loop, receiver, under the sky.

Angles of the axes are those of the encoder, azimuth continuous; the beam points where a pedestal with the scenario's
faults has it then (mount_axes.py), and the satellite is where it appears.  A tilt leans the pedestal (tilt_axis.py)
where the station has one; else it moves, but does not turn the beam.
"""

from dataclasses import dataclass
from enum import Enum, auto
from math import cos, radians
from random import Random

import numpy as np

from acu_daemon.drivers.sa3842.angles import elevation_code, elevation_deg
from acu_daemon.model import AxisLimits
from acu_daemon.sim.autotrack import Autotrack
from acu_daemon.sim.command_registers import choose_turn
from acu_daemon.sim.mount_axes import MountAxes
from acu_daemon.sim.parts import AcuParts
from acu_daemon.sim.pedestal import STEP_S, Axis, Follower
from acu_daemon.sim.receiver import Offset, Receiver, ReceiverSettings, offset_in_beam
from acu_daemon.sim.sky import Direction
from acu_daemon.sim.tilt_axis import leant

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


@dataclass(slots=True)
class AntennaTrouble:
    """What is wrong with the encoders, with what holds the beam, and with what is heard."""

    frozen_az_deg: float | None = None  # what the read-out shows instead
    frozen_el_deg: float | None = None
    slip_az_deg: float = 0.0  # reading minus what it was before
    slip_el_deg: float = 0.0
    is_turn_wrong: bool = False
    is_silent: bool = False  # the satellite sends nothing
    carrier_deg: tuple[float, float] | None = None  # the receiver hears this direction, and no satellite
    play_deg: tuple[float, float] = (0.0, 0.0)  # between encoder and beam, full width
    _beam_deg: tuple[float, float] | None = None

    def beam_deg(self, az_deg: float, el_deg: float) -> tuple[float, float]:
        """The beam behind a drive with play: it is dragged along by half of the play."""
        was = self._beam_deg or (az_deg, el_deg)
        half_az_deg, half_el_deg = self.play_deg[0] / 2.0, self.play_deg[1] / 2.0
        az_beam_deg = min(max(was[0], az_deg - half_az_deg), az_deg + half_az_deg)
        el_beam_deg = min(max(was[1], el_deg - half_el_deg), el_deg + half_el_deg)
        self._beam_deg = az_beam_deg, el_beam_deg
        return self._beam_deg


class SimulatedAntenna:
    """Each 50 Hz step: move_and_sense(), then one of halt(), follow(), track(), coast() and stow()."""

    def __init__(self, parts: AcuParts) -> None:
        scenario, choice = parts.scenario, parts.scenario.receiver
        self.az = Axis(parts.azimuth, scenario.acu.azimuth_deg)
        self.el = Axis(parts.elevation, scenario.acu.elevation_deg)
        self._leans_to_deg = None if parts.tilt is None else parts.tilt[1]
        self.tilt = Axis(TILT if parts.tilt is None else parts.tilt[0], 0.0)
        self.receiver = Receiver(
            ReceiverSettings(parts.beamwidth_deg, choice.peak_agc_db, choice.agc_noise_db, choice.tracking_noise_deg),
            Random(f"{parts.seed} receiver"),
            STEP_S,
        )
        self.direction: Direction | None = None
        self.offset: Offset | None = None
        self.has_signal = False
        self.trouble = AntennaTrouble()
        self._heard: Offset | None = None
        self._sky = parts.sky
        self._scenario = scenario
        self._mount = None if scenario.mount == MountAxes() else scenario.mount
        self._zero_deg = scenario.encoder_zero_deg(parts.start_tai_s)
        self._encoder_random = Random(f"{parts.seed} encoder")
        self._sector_bit = scenario.acu.sector_bit
        self._sector_random = Random(f"{parts.seed} sector")
        self._skyline = parts.skyline
        self._losses = [(*loss.window_tai_s(parts.start_tai_s), loss) for loss in scenario.losses]
        self._autotrack = Autotrack(self.az, self.el)
        self._follow_az, self._follow_el = Follower(parts.azimuth), Follower(parts.elevation)
        self._middle_az_deg = (parts.azimuth.min_deg + parts.azimuth.max_deg) / 2.0
        self._driven_by = Drive.HALT

    @property
    def is_sector_high(self) -> bool:
        """What the sector bit shows: whether the azimuth is in the high half of its range, if it is driven."""
        if self._sector_bit == "random":
            return self._sector_random.random() < 0.5
        if self._sector_bit != "driven":
            return self._sector_bit == "stuck-1"
        return (self.az.angle_deg >= self._middle_az_deg) != self.trouble.is_turn_wrong

    @property
    def tilt_code(self) -> int:
        """Where the tilt axis is."""
        return elevation_code(self.tilt.angle_deg)

    @property
    def boresight_deg(self) -> tuple[float, float]:
        """True azimuth (of any turn) and elevation of the beam, apparent: where what it hears appears.

        Of a dish that is raised beyond the zenith they are its own, the elevation over 90 deg.
        """
        az_deg, el_deg = self._pedestal_beam_deg
        return (az_deg, el_deg) if self._leans_to_deg is None else self._leant(az_deg, el_deg, self.tilt.angle_deg)

    def _leant(self, az_deg: float, el_deg: float, tilt_deg: float) -> tuple[float, float]:
        return leant(az_deg, el_deg, tilt_deg, self._leans_to_deg or 0.0)

    @property
    def _pedestal_beam_deg(self) -> tuple[float, float]:
        """The beam's direction as the pedestal stands, a tilt left out."""
        trouble = self.trouble
        az_deg = self.az.angle_deg - self._zero_deg[0] - trouble.slip_az_deg
        el_deg = self.el.angle_deg - self._zero_deg[1] - trouble.slip_el_deg
        if trouble.play_deg != (0.0, 0.0):
            az_deg, el_deg = trouble.beam_deg(az_deg, el_deg)
        if self._mount is None:
            return az_deg, el_deg
        beam_az_deg, beam_el_deg = self._mount.beam_deg(az_deg, el_deg)
        return (beam_az_deg + 180.0, 180.0 - beam_el_deg) if el_deg > 90.0 else (beam_az_deg, beam_el_deg)

    def reading_deg(self, part_s: float) -> tuple[float, float]:
        """Azimuth (continuous) and elevation as the encoders show them, with noise, part_s after the last step."""
        az_deg, el_deg = self.az.angle_after_deg(part_s), self.el.angle_after_deg(part_s)
        if noise_deg := self._scenario.encoder.noise_deg:
            gauss = self._encoder_random.gauss
            az_deg += gauss(0.0, noise_deg) / max(abs(cos(radians(el_deg))), _LEAST_COS_EL)
            el_deg += gauss(0.0, noise_deg)
        frozen_az_deg, frozen_el_deg = self.trouble.frozen_az_deg, self.trouble.frozen_el_deg
        return (
            az_deg if frozen_az_deg is None else frozen_az_deg,
            el_deg if frozen_el_deg is None else frozen_el_deg,
        )

    def slip(self, az_deg: float, el_deg: float) -> None:
        """The encoders slip on their shafts: readings jump, the beam stays; the servo begins anew."""
        self.az.angle_deg += az_deg
        self.el.angle_deg += el_deg
        self.trouble.slip_az_deg += az_deg
        self.trouble.slip_el_deg += el_deg
        self._driven_by = Drive.HALT

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
        self._zero_deg = self._scenario.encoder_zero_deg(tai_s)
        fade_db, is_silent, is_connected = 0.0, self.trouble.is_silent, True
        for start_s, end_s, loss in self._losses:
            if start_s <= tai_s < end_s:
                fade_db += loss.depth_db
                is_silent |= loss.cause == "silence-zone"
                is_connected &= loss.cause != "receiver"
        self.direction, self.offset = self._sky.direction(tai_s), None
        if self.direction is not None:
            self.offset = self._offset_of(self.direction[0], self.direction[1])
            if self._skyline is not None:
                is_silent |= self.direction[1] < float(self._skyline.heights_deg(np.array(self.direction[0])))
        heard = None if is_silent else self.offset
        if self.trouble.carrier_deg is not None:
            heard = self._offset_of(*self.trouble.carrier_deg)
        self._heard = heard
        self.has_signal = self.offset is not None and not is_silent and is_connected
        self.receiver.is_valid = is_connected
        self.receiver.sense(None if heard is None else heard.angle_deg, fade_db, threshold_db)

    def _offset_of(self, az_deg: float, el_deg: float) -> Offset:
        """Where a direction stands in the beam, right and up as the pedestal has them."""
        if self._leans_to_deg is not None:
            az_deg, el_deg = self._leant(az_deg, el_deg, -self.tilt.angle_deg)
        return offset_in_beam(az_deg, el_deg, *self._pedestal_beam_deg)

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
        if self._heard is None:
            self.halt()
            return
        measured = self.receiver.error_signal(self._heard)
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
