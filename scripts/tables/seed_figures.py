"""What Kuga and Carrara print: reference orbit, stations, passes (1990, tables 1 and 3; 1988, table 5.4)."""

from dataclasses import dataclass, replace

from acu_daemon.model import Station
from tables.reference_orbit import OrbitAtEpoch

ORBIT = OrbitAtEpoch("1989-01-31T09:58:00Z", 7180.0, 0.0436, 23.82, 240.14, 15.47, 350.56)
MATCHED_ORBIT = replace(ORBIT, raan_deg=ORBIT.raan_deg - 15.5)  # with this node pass 8 has about the printed geometry
MIN_ELEVATION_DEG = 5.0

EXACT = {
    "Alcantara": Station("Alcantara", -2.18, -44.26, 39.0),
    "Cuiaba": Station("Cuiaba", -15.53, -56.07, 277.0),
}
ROUNDED = {  # what the estimators take
    "Alcantara": Station("Alcantara", -2.1, -44.2, 30.0),
    "Cuiaba": Station("Cuiaba", -15.5, -56.0, 270.0),
}


@dataclass(frozen=True, slots=True)
class SeedRow:
    """One row of the papers' tables: seconds of readings, and the largest error after them by either method."""

    used_s: int
    deterministic_deg: float  # Kuga and Carrara 1990, table 3; Kuga and Carrara 1988, table 5.3
    kalman_deg: float  # Kuga and Carrara 1988, table 5.4

    @property
    def better_deg(self) -> float:
        return min(self.deterministic_deg, self.kalman_deg)


@dataclass(frozen=True, slots=True)
class SeedPass:
    """One pass of the papers' table 1, and where it lies on the reference orbit."""

    station: str
    label: str
    orbit: OrbitAtEpoch
    rise_min: float  # minutes after epoch, roughly: picks the pass
    printed_s: float
    printed_elevation_deg: float
    rows: tuple[SeedRow, ...]


def _rows(first_s: int, step_s: int, *figures: tuple[float, float]) -> tuple[SeedRow, ...]:
    return tuple(SeedRow(first_s + k * step_s, *pair) for k, pair in enumerate(figures))


_ALCANTARA_8 = _rows(300, 300, (0.50, 0.53), (0.32, 0.20), (0.20, 0.13))
_CUIABA_8 = _rows(300, 300, (0.52, 0.55), (0.36, 0.22), (0.22, 0.13))
_MATCHED, _PRINTED = "8 desc., geometry-matched", "8 desc., as printed"

PASSES = (
    SeedPass("Alcantara", "2 asc.", ORBIT, 100, 450, 15.9, _rows(60, 150, (0.90, 0.85), (0.65, 0.50), (0.52, 0.15))),
    SeedPass("Alcantara", "6 desc.", ORBIT, 534, 587, 12.3, _rows(60, 150, (0.32, 0.29), (0.25, 0.25), (0.23, 0.22))),
    SeedPass("Alcantara", "7 desc.", ORBIT, 639, 925, 36.8, _rows(300, 300, (0.40, 0.42), (0.28, 0.18), (0.17, 0.13))),
    SeedPass("Alcantara", _MATCHED, MATCHED_ORBIT, 751, 957, 46.8, _ALCANTARA_8),
    SeedPass("Cuiaba", _MATCHED, MATCHED_ORBIT, 749, 978, 41.2, _CUIABA_8),
    SeedPass("Cuiaba", "9 desc.", ORBIT, 852, 1018, 60.4, _rows(300, 300, (0.88, 0.86), (0.45, 0.25), (0.25, 0.15))),
)
PRINTED_PASS_8 = (  # the printed elements taken at their word
    SeedPass("Alcantara", _PRINTED, ORBIT, 746, 957, 46.8, _ALCANTARA_8),
    SeedPass("Cuiaba", _PRINTED, ORBIT, 746, 978, 41.2, _CUIABA_8[:2]),  # it sets before 900 s
)
