"""The memory of the mount for people: terms, passes, what to put into station.toml, pictures."""

from collections.abc import Mapping, Sequence
from datetime import datetime
from pathlib import Path

import numpy as np

from acu_daemon.assist.estimators.full.pedestal_prior import IA, IE, PEDESTAL_TERMS
from acu_daemon.assist.mount_memory.day_and_night import swing_of
from acu_daemon.assist.mount_memory.mount_fit import FittedPass, supported
from acu_daemon.assist.mount_memory.pedestal_memory import PREFERRED, PedestalMemory, a_priori_sigmas
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.edge.mount_memory_file import PassRow
from acu_daemon.units import DEG, Array

SHOWN_PASSES = 10
KEYS = {"IA": "ia", "CA": "ca", "IE": "ie", "NPAE": "npae", "AN": "an", "AW": "aw", "TF": "tf"}  # of [mount]


def terms_lines(memory: PedestalMemory, settings: EstimatorSettings) -> list[str]:
    """The terms of the memory that predicts, in deg, and which of them the data support."""
    sigma = a_priori_sigmas(settings)[int(memory.has_mount)]
    known = memory.chosen.terms
    now = np.sqrt(np.diag(known.covariance))
    told = supported(known, sigma)
    which = "all terms predict" if memory.has_mount else "IA, CA, IE and RF predict"
    lines = [
        f"{which}: the passes are likelier with NPAE, AN, AW and TF by {memory.evidence:.1f} in the logarithm "
        f"(from {PREFERRED:g} on they predict)",
        "term      deg      sigma   before any pass",
    ]
    for k, name in enumerate(PEDESTAL_TERMS):
        if sigma[k] > 0.0:
            word = "told by the data" if told[k] else "hardly told by the data"
            lines.append(f"{name:5}{known.mean[k] / DEG:+9.4f}{now[k] / DEG:9.4f}{sigma[k] / DEG:9.4f}   {word}")
    lines.append("beyond [mount]; RF: what the refraction is off the one told, at 45 deg of elevation")
    if memory.is_still:
        return [*lines, f"IA and IE hold still: likelier by {memory.still_evidence:.1f} than that they move by the day"]
    return lines + [_swing_line(memory.chosen.mean, term) for term in (IA, IE) if sigma[term] > 0.0]


def _swing_line(mean: Array, term: int) -> str:
    amplitude, share = swing_of(mean, term)
    utc_h = round(12.0 + 24.0 * share) % 24  # days of tai_s begin at noon
    return f"{PEDESTAL_TERMS[term]} by day and night: +-{amplitude / DEG:.4f} deg, highest at {utc_h} h UTC"


def pass_lines(rows: Sequence[PassRow]) -> list[str]:
    """The last passes."""
    lines = ["pass                   IA, deg           IE, deg           satellite"]
    for one in rows[-SHOWN_PASSES:]:
        ia, ie = f"{one.ia_deg:+.3f} +- {one.ia_sigma_deg:.3f}", f"{one.ie_deg:+.3f} +- {one.ie_sigma_deg:.3f}"
        lines.append(f"{one.utc:23}{ia:18}{ie:18}{one.satellite}" + (f"   {one.what}" if one.what else ""))
    return lines


def toml_lines(memory: PedestalMemory, settings: EstimatorSettings, given_deg: Mapping[str, float]) -> list[str]:
    """What to put into [mount]: what is there and what was found together, of the terms that the data tell.

    given_deg: the terms of [mount] now, by their keys.
    """
    sigma = a_priori_sigmas(settings)[int(memory.has_mount)]
    known = memory.chosen.terms
    now, told = np.sqrt(np.diag(known.covariance)), supported(known, sigma)
    lines = ["[mount]"]
    for k, name in enumerate(PEDESTAL_TERMS):
        if name in KEYS and told[k]:
            key, found_deg = f"{KEYS[name]}_deg", float(known.mean[k]) / DEG
            lines.append(f"{key} = {given_deg[key] + found_deg:.4f}")
            lines.append(f"{KEYS[name]}_sigma_deg = {now[k] / DEG:.4f}")
    return lines


def residual_lines(fitted: Sequence[FittedPass]) -> list[str]:
    """What every pass's best orbit leaves, rms, without and with the terms."""
    lines = ["rms, deg: across before, after   elevation before, after   pass"]
    for one in fitted:
        across, up = (
            [float(np.sqrt(np.mean(np.square(left[k])))) for left in (one.before_deg, one.after_deg)] for k in (0, 1)
        )
        what = f"   left out: {one.why_not}" if one.why_not else ""
        lines.append(f"{across[0]:18.4f}{across[1]:9.4f}{up[0]:16.4f}{up[1]:9.4f}   {one.label}{what}")
    return lines


def plot_drift(path: Path, rows: Sequence[PassRow], title: str) -> None:
    """Draw IA and IE of every pass over time."""
    from matplotlib.figure import Figure  # slow to load

    figure = Figure(figsize=(10.0, 5.0), dpi=110, layout="constrained")
    axes = figure.subplots(2, 1, sharex=True)
    at = [datetime.fromisoformat(one.utc) for one in rows]
    for one, name in zip(axes, ("ia", "ie"), strict=True):
        values = [getattr(row, f"{name}_deg") for row in rows]
        sigmas = [getattr(row, f"{name}_sigma_deg") for row in rows]
        one.errorbar(at, values, yerr=sigmas, fmt="o", markersize=3, linewidth=0.8, color="#3d7ea6")
        one.set_ylabel(f"{name.upper()}, deg")
        one.grid(alpha=0.3)
    figure.suptitle(title)
    figure.savefig(path)


def plot_residuals(path: Path, fitted: Sequence[FittedPass], title: str) -> None:
    """Draw what the best orbits leave over azimuth and elevation, without and with the terms."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(11.0, 6.5), dpi=110, layout="constrained")
    axes = figure.subplots(2, 2, sharex="col", sharey="row")
    for row, what in enumerate(("across, deg", "elevation, deg")):
        for column, angle in enumerate(("az_deg", "el_deg")):
            one = axes[row][column]
            for kind, colour in (("before_deg", "#c8553d"), ("after_deg", "#0b6e4f")):
                at = np.concatenate([getattr(some, angle) for some in fitted])
                left = np.concatenate([getattr(some, kind)[row] for some in fitted])
                one.plot(at, left, ".", markersize=1.5, alpha=0.4, color=colour, label=kind.removesuffix("_deg"))
            one.grid(alpha=0.3)
        axes[row][0].set_ylabel(what)
    axes[1][0].set_xlabel("azimuth, deg")
    axes[1][1].set_xlabel("elevation, deg")
    axes[0][0].legend(markerscale=6)
    figure.suptitle(title)
    figure.savefig(path)
