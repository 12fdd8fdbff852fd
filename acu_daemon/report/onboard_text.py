"""What is said of a tracking profile and of scenarios: lines for people, the header of a file."""

from collections.abc import Mapping, Sequence
from math import isfinite

import numpy as np

from acu_daemon.edge.onboard_files import PlannedPass
from acu_daemon.edge.onboard_scenarios import ScenarioRow
from acu_daemon.model import AxisLimits
from acu_daemon.onboard.pipeline import Made
from acu_daemon.onboard.profile import Objective, Task, peak_rate_deg_s
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.units import Array

GAIN = 0.01  # what counts as a reduction


def header(planned: PlannedPass, task: Task, made: Made, objective: Objective) -> dict[str, str]:
    """More of a tracking-parameter file's header."""
    station, antenna = planned.station, planned.file.antenna
    return {
        "OBJECTIVE": objective,
        "SATELLITE": " ".join(planned.label.split()),
        "STATION": f"{' '.join(station.name.split())} {station.latitude_deg:.6f} {station.longitude_deg:.6f} "
        f"{station.height_m:.1f}",
        "MARGIN_DEG": f"{task.margin_deg:g}",
        "AZIMUTH_LIMITS": _limits(task.azimuth),
        "ELEVATION_LIMITS": _limits(task.elevation),
        "MOUNT_DEG": " ".join(f"{angle:g}" for angle in antenna.mount.angles_deg),
        "BUS_DEG": " ".join(f"{angle:g}" for angle in antenna.bus.angles_deg),
        "BORESIGHT_DEG": f"{antenna.boresight.elevation_deg:g} {antenna.boresight.cross_deg:g}",
        "BACKLASH_DEG": f"{antenna.backlash.azimuth_deg:g} {antenna.backlash.elevation_deg:g}",
        "PEAK_AZIMUTH_RATE_DEG_S": f"{peak_rate_deg_s(made.profile.azimuth, task.view):.9g}",
        "PEAK_ELEVATION_RATE_DEG_S": f"{peak_rate_deg_s(made.profile.elevation, task.view):.9g}",
    }


def _limits(limits: AxisLimits) -> str:
    return (
        f"{limits.min_deg:g} {limits.max_deg:g} deg, {limits.max_rate_deg_s:g} deg/s, "
        f"{limits.max_acceleration_deg_s2:g} deg/s2"
    )


def summary(planned: PlannedPass, task: Task, made: Made, single_deg_s: float) -> list[str]:
    """Lines on one profile; single_deg_s: the largest azimuth rate of pointing at the station itself."""
    profile, seen = made.profile, planned.seen
    start, end = float(task.view.tai_s[0]), float(task.view.tai_s[-1])
    peak = peak_rate_deg_s(profile.azimuth, task.view)
    lines = [
        f"{planned.label} over {planned.station.name}, {utc_text(start, 0)} to {utc_text(end, 0)}, "
        f"culmination {seen.culmination_el_deg:.1f} deg",
        f"method {profile.method}: largest azimuth rate {peak:.3f} deg/s, of the station itself {single_deg_s:.3f}; "
        f"elevation {peak_rate_deg_s(profile.elevation, task.view):.3f} deg/s; {profile.azimuth.start_s.size} pieces",
    ]
    if profile.bound is not None:
        bound = profile.bound
        lines.append(
            f"no path within {task.margin_deg:g} deg is below {bound.rate_deg_s:.3f} deg/s: azimuth is at least "
            f"{bound.low_deg:.2f} deg at {utc_text(start + bound.low_time_s, 1)[11:]} and at most {bound.high_deg:.2f} "
            f"at {utc_text(start + bound.high_time_s, 1)[11:]}"
        )
    first = made.first[0]
    off = f"{first.name} {first.value:.3f} of {first.limit:g} deg{first.detail}"
    lines.append(f"modified profile, before backlash is led: {off}")
    if task.imaging.any():
        at_s = task.view.time_s[task.imaging]
        azimuth, elevation = (float(np.abs(path.value(at_s, 1)).max()) for path in (profile.azimuth, profile.elevation))
        lines.append(f"while the camera works: azimuth at most {azimuth:.3f} deg/s, elevation {elevation:.3f}")
    return lines


def scenario_table(rows: Sequence[ScenarioRow], margin_deg: float) -> list[str]:
    """Lines: the methods' rates by kind and over all, shares, reductions, times."""
    lines = [
        f"{len(rows)} scenarios, margin {margin_deg:g} deg; largest azimuth rates, medians, deg/s",
        f"{'kind':16}{'count':>6}{'single':>9}{'three':>9}{'search':>9}{'free':>9}{'bound':>9}"
        f"{'search -1 %':>13}{'free/three':>12}",
    ]
    kinds = dict.fromkeys(row.kind for row in rows)
    groups = {kind: [row for row in rows if row.kind == kind] for kind in kinds} | {"all": list(rows)}
    lines += [_line(name, group) for name, group in groups.items()]
    there = [row for row in rows if isfinite(row.free_deg_s)]
    a = _columns(there)
    over = a["free"] / a["bound"] - 1.0
    lines += [
        "",
        f"search below three by more than {GAIN:.0%}: {_share(a['search'] < (1.0 - GAIN) * a['three'])}; "
        f"median reduction {_median(1.0 - a['search'] / a['three'])}",
        f"free below search: median {_median(1.0 - a['free'] / a['search'])}; "
        f"below three: {_median(1.0 - a['free'] / a['three'])}",
        f"free above its bound: median {_median(over)}, worst {np.max(over, initial=0.0):.2%}",
        f"free <= 1.005 search and search <= three: "
        f"{_share((a['free'] <= 1.005 * a['search']) & (a['search'] <= a['three']))}",
        f"samples beyond the margin (20 Hz, all methods): {sum(row.violations for row in rows)}",
        f"processor time of all four methods: median {np.median([row.seconds for row in rows]):.2f} s, "
        f"most {max(row.seconds for row in rows):.2f} s",
    ]
    if missing := [str(row.seed) for row in rows if not isfinite(row.free_deg_s)]:
        lines.append(f"no free path within the margin, left out of the shares above: seeds {', '.join(missing)}")
    return lines + _imaging(rows)


def _imaging(rows: Sequence[ScenarioRow]) -> list[str]:
    asked = [row for row in rows if row.imaging_free_deg_s is not None]
    if not asked:
        return []
    single, free = (np.array([getattr(row, f"imaging_{name}_deg_s") for row in asked]) for name in ("single", "free"))
    still = np.array([bool(row.imaging_still) for row in asked])
    return [
        f"imaging first, {len(asked)} scenarios: largest azimuth rate while the camera works, median "
        f"{np.median(single):.3f} deg/s of the station itself, {np.median(free):.3f} planned; both axes still: "
        f"{_share(still)}"
    ]


def _line(name: str, rows: Sequence[ScenarioRow]) -> str:
    a = _columns(rows)
    medians = "".join(f"{np.nanmedian(a[key]):9.3f}" for key in ("single", "three", "search", "free", "bound"))
    gain = float(np.mean(a["search"] < (1.0 - GAIN) * a["three"]))
    return f"{name:16}{len(rows):6}{medians}{gain:13.0%}{float(np.nanmedian(a['free'] / a['three'])):12.3f}"


def _columns(rows: Sequence[ScenarioRow]) -> Mapping[str, Array]:
    names = ("single", "three", "search", "free", "bound")
    return {name: np.array([getattr(row, f"{name}_deg_s") for row in rows]) for name in names}


def _share(is_so: "np.ndarray[tuple[int], np.dtype[np.bool_]]") -> str:
    return f"{int(is_so.sum())} of {is_so.size} ({is_so.mean():.0%})"


def _median(values: Array) -> str:
    return f"{np.median(values):.1%}"
