"""SIMULATION of the receiver: a beam with its first side lobe, AGC with noise, acquisition, autotrack's error signal.

The side lobe is a ring about the main one, as a circular aperture lit by 1 - r^2 / 2 has it: 1.6 half-power widths off,
20 dB down, 0.45 wide (Hankel transform).  Autotrack stands still on its crest.  With less than that between peak and
threshold it is never heard.
"""

from dataclasses import dataclass
from math import atan2, cos, degrees, exp, hypot, radians, sin, sqrt
from random import Random
from typing import NamedTuple

HALF_POWER_DB = 12.0  # a Gaussian beam is 12 (offset / full half-power width)^2 dB down: 3 dB at half the width
SIDE_LOBE_BEAMS, SIDE_LOBE_DB, SIDE_LOBE_WIDTH_BEAMS = 1.6, 20.0, 0.45
HYSTERESIS_DB = 0.5
TRACKING_NOISE_TIME_S = 0.3  # correlation time of the error signal's noise


class Offset(NamedTuple):
    """Where the satellite stands in the beam: degrees on the sky, right (azimuth rising) and up positive."""

    right_deg: float
    up_deg: float

    @property
    def angle_deg(self) -> float:
        return hypot(self.right_deg, self.up_deg)


def offset_in_beam(az_deg: float, el_deg: float, boresight_az_deg: float, boresight_el_deg: float) -> Offset:
    """Offset of a direction from the boresight; its length is the angle between them."""
    d_az, el, el0 = radians(az_deg - boresight_az_deg), radians(el_deg), radians(boresight_el_deg)
    right = cos(el) * sin(d_az)
    up = sin(el) * cos(el0) - cos(el) * sin(el0) * cos(d_az)
    forward = sin(el) * sin(el0) + cos(el) * cos(el0) * cos(d_az)
    across = hypot(right, up)
    scale = degrees(atan2(across, forward)) / across if across > 1e-12 else degrees(1.0)
    return Offset(right * scale, up * scale)


def pattern_db(beams: float) -> float:
    """How far down the pattern is, so many half-power widths off the boresight."""
    return min(_main_db(beams), _side_lobe_db(beams))


def _main_db(beams: float) -> float:
    return HALF_POWER_DB * beams**2


def _side_lobe_db(beams: float) -> float:
    return SIDE_LOBE_DB + HALF_POWER_DB * ((beams - SIDE_LOBE_BEAMS) / SIDE_LOBE_WIDTH_BEAMS) ** 2


def from_crest(offset: Offset, beamwidth_deg: float) -> Offset:
    """The offset of a direction from the crest of its lobe: of the side lobe along the ring's radius."""
    beams = offset.angle_deg / beamwidth_deg
    if _main_db(beams) <= _side_lobe_db(beams):
        return offset
    share = 1.0 - SIDE_LOBE_BEAMS / beams
    return Offset(share * offset.right_deg, share * offset.up_deg)


@dataclass(frozen=True, slots=True)
class ReceiverSettings:
    """The beam's full width at half power; the AGC on the boresight, in dB over no signal; noise, 1 sigma."""

    beamwidth_deg: float
    peak_agc_db: float
    agc_noise_db: float
    tracking_noise_deg: float


class Receiver:
    """What the ACU hears of the satellite; sense() once per 50 Hz step."""

    def __init__(self, settings: ReceiverSettings, random: Random, step_s: float) -> None:
        self._settings = settings
        self._random = random
        self._keep = exp(-step_s / TRACKING_NOISE_TIME_S)
        self._renew_deg = settings.tracking_noise_deg * sqrt(1.0 - self._keep**2)
        self._noise_right_deg = self._noise_up_deg = 0.0
        self.is_valid = True
        self.is_acquired = False
        self.agc_db = 0.0

    def sense(self, offset_deg: float | None, fade_db: float, threshold_db: float) -> None:
        """Hear the satellite at an offset, or None for no signal at all."""
        settings = self._settings
        if not self.is_valid:
            self.agc_db, self.is_acquired = 0.0, False
            return
        level_db = 0.0
        if offset_deg is not None:
            level_db = max(0.0, settings.peak_agc_db - pattern_db(offset_deg / settings.beamwidth_deg) - fade_db)
        self.agc_db = max(0.0, level_db + self._random.gauss(0.0, settings.agc_noise_db))
        needed_db = threshold_db - HYSTERESIS_DB if self.is_acquired else threshold_db
        self.is_acquired = self.agc_db >= needed_db

    def error_signal(self, offset: Offset) -> Offset:
        """The measured offset from the crest of a lobe; its noise is correlated over TRACKING_NOISE_TIME_S."""
        offset = from_crest(offset, self._settings.beamwidth_deg)
        if self._renew_deg == 0.0:
            return offset
        gauss, keep = self._random.gauss, self._keep
        self._noise_right_deg = keep * self._noise_right_deg + gauss(0.0, self._renew_deg)
        self._noise_up_deg = keep * self._noise_up_deg + gauss(0.0, self._renew_deg)
        return Offset(offset.right_deg + self._noise_right_deg, offset.up_deg + self._noise_up_deg)
