"""The simulated pedestal as a chain of rotations: axes that lean or are not square, a beam aside, a dish that sags.

Nothing here is first order, and nothing comes from acu_daemon.pointing.  In east, north, up, a beam that leaves the
dish c to the left of the perpendicular to the elevation axis points to

    T Rz(-A) Ry(-n) Rx(E) (-sin c, cos c, 0)

E: how far the dish is raised; n: the elevation axis's right end is high by that; A: how far the pedestal is turned,
clockwise; T: the turn by the vector (-AN, -AW, 0) that leans the azimuth axis north and west.  The encoders then count
A + IA and E + IE + TF cos E: the beam sags below what they show.
"""

from dataclasses import dataclass
from math import asin, atan2, cos, degrees, hypot, radians, sin

import numpy as np
import numpy.typing as npt

Vector = npt.NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class MountAxes:
    """The pedestal's faults, degrees; docs/antenna-model.md has their definitions and signs."""

    ia_deg: float = 0.0
    ie_deg: float = 0.0
    ca_deg: float = 0.0
    npae_deg: float = 0.0
    an_deg: float = 0.0
    aw_deg: float = 0.0
    tf_deg: float = 0.0

    def beam_deg(self, encoder_az_deg: float, encoder_el_deg: float) -> tuple[float, float]:
        """Azimuth in (-180, 180] and elevation, at most 90, of the beam when the encoders read these angles."""
        shown = radians(encoder_el_deg - self.ie_deg)
        raised = shown
        for _ in range(8):  # shown = raised + TF cos raised; each turn gains a factor TF
            raised = shown - radians(self.tf_deg) * cos(raised)
        c, n = radians(self.ca_deg), radians(self.npae_deg)
        x, y, z = -sin(c), cos(c) * cos(raised), cos(c) * sin(raised)
        x, z = cos(n) * x - sin(n) * z, sin(n) * x + cos(n) * z
        a = radians(encoder_az_deg - self.ia_deg)
        x, y = cos(a) * x + sin(a) * y, cos(a) * y - sin(a) * x
        east, north, up = self._lean() @ np.array([x, y, z])
        return degrees(atan2(east, north)), degrees(atan2(up, hypot(east, north)))

    def encoders_deg(self, az_deg: float, el_deg: float) -> tuple[float, float]:
        """Encoder angles that point the beam there; azimuth within 180 deg of az_deg, elevation above 90 where asked.

        Within CA + NPAE of the zenith of the leaning pedestal no angles do: then those that come nearest.
        """
        a, h = radians(az_deg), radians(el_deg)
        x, y, z = self._lean().T @ np.array([cos(h) * sin(a), cos(h) * cos(a), sin(h)])
        c, n = radians(self.ca_deg), radians(self.npae_deg)
        raised = asin(min(max((z + sin(n) * sin(c)) / (cos(n) * cos(c)), -1.0), 1.0))
        if cos(h) < 0.0:
            raised = np.pi - raised
        across, forward = -cos(n) * sin(c) - sin(n) * cos(c) * sin(raised), cos(c) * cos(raised)
        turned_deg = degrees(atan2(x, y) - atan2(across, forward))
        turned_deg = az_deg + (turned_deg - az_deg + 180.0) % 360.0 - 180.0
        return turned_deg + self.ia_deg, degrees(raised) + self.ie_deg + self.tf_deg * cos(raised)

    def _lean(self) -> Vector:
        """T, by Rodrigues' formula."""
        x, y = -radians(self.an_deg), -radians(self.aw_deg)
        angle = hypot(x, y)
        if angle == 0.0:
            return np.eye(3)
        cross = np.array([[0.0, 0.0, y], [0.0, 0.0, -x], [-y, x, 0.0]]) / angle
        lean: Vector = np.eye(3) + sin(angle) * cross + (1.0 - cos(angle)) * cross @ cross
        return lean
