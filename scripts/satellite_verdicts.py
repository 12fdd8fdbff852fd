"""How often a recording is taken for another satellite's, and another's for its own: real passes on public elements.

Its own elements, with a clock a minute off, and those of other low orbits of a public list whose epoch is brought to
the pass, at random (docs/decisions/0049).  Needs ../shared/data.  A minute or two.

    .venv/bin/python scripts/satellite_verdicts.py [COUNT]      others for each pass, 30
"""

import gzip
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[1]
sys.path.insert(0, str(ROOT / "tests"))

import real_passes  # noqa: E402

from acu_daemon.assist.screening.another_satellite import why_not_this_satellite  # noqa: E402
from acu_daemon.assist.settings import EstimatorSettings  # noqa: E402
from acu_daemon.model import Readings  # noqa: E402
from acu_daemon.orbit.sgp4_source import Sgp4Propagator  # noqa: E402
from acu_daemon.orbit.tle import parse_tle  # noqa: E402

LIST = ROOT.parent / "shared" / "data" / "tle_sets" / "celestrak_active_2026-08-18.3le.gz"
NOISE_DEG, BIAS_DEG, STEP_S, LATE_S = 0.03, 0.05, 2.0, 60.0
LOW_RAD_S = 2.0 * np.pi / 7200.0
PARTS = (0.2, 1.0)


def seen(real: real_passes.RealPass, part: float, late_s: float, rng: np.random.Generator) -> Readings:
    """Readings of the first part of a pass, by a clock that is late_s fast."""
    tai_s = np.arange(real.tai_s[0], real.tai_s[0] + part * np.ptp(real.tai_s), STEP_S)
    az_deg, el_deg = real.sky(tai_s)
    bias_az_deg, bias_el_deg = rng.normal(0.0, BIAS_DEG, 2)
    readings = real_passes.noisy(az_deg + bias_az_deg, el_deg + bias_el_deg, tai_s, NOISE_DEG, rng)
    return replace(readings, tai_s=tai_s + late_s)


def main() -> None:
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 30
    rng = np.random.default_rng(1)
    sets, _ = parse_tle(gzip.decompress(LIST.read_bytes()).decode(), LIST.name)
    others = [one for one in sets if one.mean_motion_rad_s > LOW_RAD_S]
    told = {"own": [0, 0], "own, a clock 60 s off": [0, 0], "others": [0, 0]}
    for name in real_passes.names():
        real = real_passes.load(name)
        (own, *_), _ = parse_tle(real.tle_path.read_text(), real.tle_path.name)
        drawn = [replace(others[k], epoch_tai_s=own.epoch_tai_s) for k in rng.choice(len(others), count, replace=False)]
        cases = [("own", own, 0.0), *(("own, a clock 60 s off", own, late_s) for late_s in (LATE_S, -LATE_S))]
        for kind, elements, late_s in [*cases, *(("others", one, 0.0) for one in drawn)]:
            for part in PARTS:
                readings = seen(real, part, late_s, rng)
                told[kind][0] += 1
                told[kind][1] += bool(
                    why_not_this_satellite(Sgp4Propagator(elements), real.site, EstimatorSettings(), readings)
                )
    for kind, (cases_count, told_count) in told.items():
        print(f"{kind:24} {cases_count:5} cases, {told_count:5} told as another satellite")


if __name__ == "__main__":
    main()
