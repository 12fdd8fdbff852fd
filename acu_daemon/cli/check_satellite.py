"""What `acu-daemon check` says of a satellite: its elements, its next pass, and whether the antenna can follow."""

from collections.abc import Iterator
from pathlib import Path

from acu_daemon.cli.check_finding import GO, NO_GO, WARN, Finding
from acu_daemon.cli.options import (
    NEXT_PASS_DAYS,
    Target,
    ending,
    load_target,
    longest_lead,
    nearest_to_pass,
    not_covered,
    open_ends,
)
from acu_daemon.control.tracking.pass_plan import plan_pass
from acu_daemon.edge.clock import is_clock_synchronised, system_tai_s
from acu_daemon.edge.clock_sense import before_elements
from acu_daemon.errors import AcuDaemonError, OrbitError
from acu_daemon.model import Pass
from acu_daemon.orbit.passes import find_passes
from acu_daemon.orbit.propagator import is_ephemeris
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.orbit.visibility import why_none
from acu_daemon.pointing.outage import kept_out, sun_outages
from acu_daemon.pointing.wrap import middle_deg
from acu_daemon.units import DAY_S


def satellite_findings(config: Path, name: str, now_tai_s: float, folders: tuple[Path, ...]) -> Iterator[Finding]:
    try:
        target = load_target(config, name, now_tai_s, is_strict=False, folders=folders)
        target = nearest_to_pass(config, name, target, now_tai_s, is_strict=False, folders=folders)
    except AcuDaemonError as error:
        yield Finding(NO_GO, f"{name}: files", str(error))
        return
    elements = target.elements
    age = f"epoch {utc_text(elements.epoch_tai_s, 0)}, {(now_tai_s - elements.epoch_tai_s) / DAY_S:.1f} days old"
    is_now = abs(now_tai_s - system_tai_s()) < DAY_S  # not a rehearsal's time
    if is_now and (wrong := before_elements(elements, now_tai_s, is_clock_synchronised())):
        yield Finding(NO_GO, f"{name}: elements", f"{wrong}; `run` waits until then")
        return
    if elements.errors:
        yield Finding(NO_GO, f"{name}: elements", "; ".join(elements.errors))
        return
    told = [*elements.warnings, age, *([elements.choice] if elements.choice else [])]
    yield Finding(
        WARN if elements.warnings else GO,
        f"{name}: elements",
        "; ".join(told),
    )
    try:
        yield from _next_pass(name, target, now_tai_s)
    except OrbitError as error:
        yield Finding(NO_GO, f"{name}: next pass", str(error))


def _next_pass(name: str, target: Target, now_tai_s: float) -> Iterator[Finding]:
    station = target.station
    lowest_deg = station.station.min_elevation_deg
    propagator = target.elements.propagator
    passes = find_passes(propagator, station.site, now_tai_s, now_tai_s + DAY_S, lowest_deg)
    has_spans = is_ephemeris(propagator)
    if not passes:
        until = ending(target, now_tai_s + DAY_S)
        why = "" if until else why_none(propagator, station.site, now_tai_s, now_tai_s + DAY_S, lowest_deg)
        texts = [f"none above {lowest_deg:g} deg within a day", why, until]
        verdict = NO_GO if until and not has_spans else WARN
        yield Finding(verdict, f"{name}: next pass", "; ".join(text for text in texts if text))
        return
    coming = passes[0]
    if lacking := not_covered(target, coming, now_tai_s):
        yield Finding(NO_GO, f"{name}: next pass", lacking)
        return
    lasts = open_ends(coming, now_tai_s, now_tai_s + DAY_S) or f"{coming.duration_s / 60:.1f} min"
    hidden_s = sum(end - begin for begin, end in coming.hidden_tai_s)
    hidden = f", {hidden_s:.0f} s of it behind the mask" if hidden_s else ""
    yield Finding(
        GO,
        f"{name}: next pass",
        f"{utc_text(coming.rise_tai_s, 0)}, {lasts}, up to {coming.culmination_el_deg:.1f} deg{hidden}",
    )
    if not has_spans and (until := ending(target, now_tai_s + NEXT_PASS_DAYS * DAY_S)):
        yield Finding(WARN, f"{name}: decay", until)
    azimuth, elevation = station.acu.azimuth.limits(), station.acu.elevation.limits()
    start_tai_s = coming.rise_tai_s
    plan = plan_pass(propagator, station.site, coming, middle_deg(azimuth), azimuth, start_tai_s, elevation=elevation)
    if plan.note:
        yield Finding(WARN, f"{name}: cable wrap", plan.note)
    else:
        yield Finding(GO, f"{name}: cable wrap", f"the pass is held from azimuth {plan.start_az_deg:.1f} deg on")
    for one in plan.beyond:
        yield Finding(WARN, f"{name}: {one.axis}", str(one))
    yield from _outages(name, target, coming)
    lead_s, left_s = longest_lead(target), coming.rise_tai_s - now_tai_s
    if 0.0 < left_s < lead_s:
        why = f"the rise is in {left_s:.0f} s, from the far end of its drives the antenna needs {lead_s:.0f} s"
        yield Finding(WARN, f"{name}: approach", f"{why}: it may be late, `run` says by how much")


def _outages(name: str, target: Target, coming: Pass) -> Iterator[Finding]:
    """The sun and keep-out zones in a pass."""
    bounds, policy = target.station.bounds, target.station.envelope.sun_policy
    propagator, site = target.elements.propagator, target.station.site
    led = "; it is led around" if policy == "avoid" else "; it is followed (sun_policy)"
    for outage in sun_outages(propagator, site, bounds.sun, coming):
        yield Finding(WARN, f"{name}: sun", f"{outage}{led}")
    for kept in kept_out(propagator, site, bounds.keep_outs, coming):
        yield Finding(WARN, f"{name}: keep-out", f"{kept}; it is led around")
