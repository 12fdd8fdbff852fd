"""The report of a pass, of a watch made by hand: every figure of its JSON by value, and each in its row of the page."""

import re
from dataclasses import replace
from functools import cache
from html import unescape
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from flights import DEMO_TAI_S, demo_target
from memories import remembering

from acu_daemon.cli.options import coming_pass
from acu_daemon.cli.run_setup import make_job
from acu_daemon.control.orders import Event
from acu_daemon.control.tick_input import PassPlan
from acu_daemon.model import AngleBias, Correction, FitResult, ZenithCrossing
from acu_daemon.orbit.timescales import utc_text
from acu_daemon.report.pass_figures import pass_figures
from acu_daemon.report.pass_page import pass_page
from acu_daemon.report.pass_watch import PassWatch, SeenFit, SeenReading
from acu_daemon.units import DEG

TARGET = demo_target(receiver={"beamwidth_deg": 2.0})
COMING = replace(coming_pass(TARGET, DEMO_TAI_S), hidden_tai_s=((1.0, 6.0), (10.0, 12.5)))
RISE = COMING.rise_tai_s
AUTO, HOLD = "AUTOTRACK/FITTED", "HOLD/FITTED"
SIGMAS = np.array([*(0.001 * k * DEG for k in range(1, 18))])


def reading(k: int) -> SeenReading:
    """Each tenth of a second: before the rise, acquired, lost from 30 on, a signal again at 40, acquired at 45."""
    acquired = 20 <= k < 30 or k >= 45
    state = HOLD if 30 <= k < 45 else "ZENITH" if 50 <= k < 55 else AUTO
    level_db = 10.0 if acquired else None
    place = RISE - 1.0 + 0.1 * k, 30.0 + 0.5 * k, 20.0 + 0.1 * k
    return SeenReading(*place, acquired or k >= 40, acquired, level_db, state, 0.03 * k, 0.002 * k)


def watched() -> PassWatch:
    fit = FitResult(
        "full",
        Correction(0.11 * DEG, 0.12 * DEG, 0.0, 0.0, 0.0, 0.13 * DEG),
        *(RISE + 1.5, 77, 6, 0.0321, -1.234, 0.0567),
        AngleBias(0.021, 0.022, 0.023, 0.024, 0.025, 0.026, 0.027, 0.028),
        (31.5, 32.5, 33.5),
        covariance=np.diag(SIGMAS**2),
    )
    crossing = ZenithCrossing(RISE, RISE, 0.0, 0.0, 9.0, 0.625, 4.5, None)
    refusals = {"refusal_count": 11, "clamped_count": 12, "limited_count": 13}
    gate = SimpleNamespace(reset_count=2)
    return PassWatch(
        ticks_tai_s=[RISE - 1.0 + 0.1 * k for k in range(31)] + [RISE + 2.4 + 0.1 * k for k in range(27)],
        states=[(RISE - 1.0, "PREPOSITION"), (RISE + 1.0, AUTO), (RISE + 2.0, HOLD), (RISE + 3.5, AUTO)],
        readings=[reading(k) for k in range(60)],
        fits=[SeenFit(RISE + 1.5, fit, (0.51, 0.26))],
        events=[(RISE + 2.0, Event("turn.doubted", {"by_deg": 1.5}, is_warning=True))] * 2,
        refused=[(RISE + 2.5, "STOP", "in local")],
        latencies_s=[(RISE + 0.01 * k, 0.001 * k) for k in range(1, 101)],
        unanswered_count=14,
        notes=[(RISE + 2.0, ("L", "silent")), (RISE + 2.1, ("C", "stepped")), (RISE + 2.2, ("Z", 1.0, True, "died"))],
        plan=PassPlan(RISE + 0.0, RISE + 300.0, RISE - 20.0, 33.25, 5.0, crossing=crossing),
        area=SimpleNamespace(  # type: ignore[arg-type]
            rejected_counts={"outlier": 15}, gate=gate, state=remembering(**refusals)
        ),
    )


@cache
def figures() -> dict[str, Any]:
    job = make_job(TARGET, COMING, SimpleNamespace(byte_time_s=0.0), is_rehearsal=True)  # type: ignore[arg-type]
    made = pass_figures(job, TARGET.station, TARGET.satellite, watched(), is_whole=True)
    return made | {"station": None}


def test_what_was_acquired_before_the_rise_is_no_part_of_the_share_of_the_pass() -> None:
    job = make_job(TARGET, COMING, SimpleNamespace(byte_time_s=0.0), is_rehearsal=True)  # type: ignore[arg-type]
    watch = watched()
    early = [replace(one, has_signal=True, is_acquired=True) for one in watch.readings[:8]]
    watch = replace(watch, readings=[*early, *watch.readings[8:]])
    outcome = pass_figures(job, TARGET.station, TARGET.satellite, watch, is_whole=True)["outcome"]
    assert outcome["acquired_share"] == figures()["outcome"]["acquired_share"]
    assert outcome["first_acquired_utc"] == at(-1.0)


def at(seconds: float) -> str:
    return utc_text(RISE + seconds, 1)


EXPECTED: dict[str, dict[str, Any]] = {
    "outcome": {
        "begun_utc": at(-1.0),
        "ended_utc": at(5.0),
        "first_acquired_utc": at(1.0),
        "last_acquired_utc": at(4.9),
        "acquired_share": 0.5,
        "loss_count": 1,
        "lost_s": 1.0,
        "lost_at_end_s": 0.0,
        "longest_relock_s": 0.5,
        "largest_off_path_in_losses_beamwidths": 0.66,
        "largest_off_path_held_deg": 1.32,
        "end_state": AUTO,
    },
    "plan": {
        "rise_utc": at(0.0),
        "culmination_utc": utc_text(COMING.culmination_tai_s, 1),
        "set_utc": utc_text(COMING.set_tai_s, 1),
        "culmination_el_deg": round(COMING.culmination_el_deg, 2),
        "culmination_az_deg": round(COMING.culmination_az_deg, 2),
        "came_highest_utc": at(4.9),
        "came_highest_el_deg": 25.9,
        "start_az_deg": 33.25,
        "unwinding_count": 0,
        "zenith_largest_error_deg": 0.625,
        "zenith_lost_s": 4.5,
        "came_zenith_s": 0.5,
        "came_zenith_largest_off_deg": 1.62,
        "hidden_s": 7.5,
        "came_out_of_half_beam_s": 2.5,
        "beyond_reach": [],
    },
    "gate": {"left_out": {"outlier": 15}, "reset_count": 2},
    "latency": {"exchange_count": 100, "unanswered_count": 14, "p50_ms": 50.5, "p99_ms": 99.01, "max_ms": 100.0},
    "ticks": {"count": 58, "left_out_count": 3, "longest_gap_s": 0.4},
    "limited": {"refused_count": 11, "clamped_count": 12, "limited_count": 13},
    "correction": {
        "fit_count": 1,
        "of_utc": at(1.5),
        "reading_count": 77,
        "rejected_count": 6,
        "residual_rms_deg": 0.0321,
        "along_s": -1.234,
        "along_sigma_s": 0.51,
        "across_deg": 0.0567,
        "across_sigma_deg": 0.26,
        "raan_deg": 0.11,
        "raan_sigma_deg": 0.001,
        "mean_anomaly_deg": 0.12,
        "mean_anomaly_sigma_deg": 0.002,
        "inclination_deg": 0.13,
        "inclination_sigma_deg": 0.006,
        "station_shift_enu_m": [31.5, 32.5, 33.5],
    },
}


@pytest.mark.parametrize("part", EXPECTED)
def test_every_figure_of_a_part_is_its_own(part: str) -> None:
    assert figures()[part] == EXPECTED[part]


def test_the_lists_of_a_report_have_their_figures() -> None:
    made = figures()
    (loss,) = made["losses"]
    assert (loss["start_utc"], loss["length_s"], loss["relock_s"]) == (at(2.0), 1.0, 0.5)
    assert (loss["followed"], loss["largest_off_path_beamwidths"]) == ([{"state": HOLD, "share": 1.0}], 0.66)
    assert [(one["t_s"], one["state"], one["lasted_s"]) for one in made["states"]] == [
        (0.0, "PREPOSITION", 2.0),
        (2.0, AUTO, 1.0),
        (3.0, HOLD, 1.5),
        (4.5, AUTO, 1.5),
    ]
    names = ("az_deg", "az_sec_deg", "el_deg", "el_cot_deg", "npae_deg", "an_deg", "aw_deg", "tf_deg")
    states = (7, 8, 9, 10, 14, 15, 16, 17)
    assert made["biases"] == [
        {"name": name, "value_deg": round(0.021 + 0.001 * k, 4), "sigma_deg": round(0.001 * state, 4)}
        for k, (name, state) in enumerate(zip(names, states, strict=True))
    ]
    assert made["refused"] == [{"utc": at(2.5), "command": "STOP", "why": "in local"}]
    assert [(one["what"], one["text"]) for one in made["line"]] == [
        ("line", "silent"),
        ("clock", "stepped"),
        ("fit", "died"),
    ]
    assert [(one["name"], one["said"], one["count"]) for one in made["events"]] == [("turn.doubted", "by_deg 1.5", 2)]


def test_the_curves_of_a_report_have_their_figures() -> None:
    curves = figures()["curves"]
    assert (curves["rise_t_s"], curves["set_t_s"]) == (1.0, 301.0)
    path, off, level, latency = (curves[name] for name in ("path", "off_path", "level", "latency"))
    k = 47
    assert [path[name][k] for name in ("t_s", "az_deg", "el_deg", "is_acquired")] == [4.7, 53.5, 24.7, 1]
    assert [off[name][k] for name in ("t_s", "beamwidths", "sigma_beamwidths")] == [4.7, 0.705, 0.047]
    assert (level["db"][k], level["db"][35], path["is_acquired"][35]) == (10.0, None, 0)
    assert (latency["t_s"][9], latency["ms"][9]) == (1.1, 10.0)
    assert {name: curves["correction"][name][0] for name in curves["correction"]} == {
        "t_s": 2.5,
        "along_s": -1.234,
        "along_sigma_s": 0.51,
        "across_deg": 0.0567,
        "across_sigma_deg": 0.26,
    }


def test_each_figure_stands_in_its_row_of_the_page() -> None:
    page = pass_page(figures())
    rows: dict[str, list[list[str]]] = {}
    for line in re.findall(r"<tr>(.*?)</tr>", page):
        first, *rest = re.findall(r"<td[^>]*>(.*?)</td>", line) or [""]
        rows.setdefault(unescape(first), []).append(rest)

    def clock(seconds: float) -> str:
        return at(seconds)[11:].removesuffix("Z")

    expected = {
        "rise, first acquired": [clock(0.0), clock(1.0)],
        "highest, elevation °": [str(EXPECTED["plan"]["culmination_el_deg"]), "25.9"],
        "set, last acquired": [EXPECTED["plan"]["set_utc"][11:-1], clock(4.9)],
        "begins at azimuth °": ["33.25", ""],
        "past the zenith, s": ["4.5", "0.5"],
        "past the zenith, largest error °": ["0.625", "1.62"],
        "out of half the beam, s": ["", "2.5"],
        "behind the skyline, s": ["7.5", ""],
        "changes of the cable's turn": ["0", ""],
        clock(2.0): ["1.0", f"{HOLD} 1.0", "0.5", "0.66"],
        "along the track, s": ["-1.234", "0.51"],
        "across the track, °": ["0.0567", "0.26"],
        "node, °": ["0.11", "0.001"],
        "mean anomaly, °": ["0.12", "0.002"],
        "inclination, °": ["0.13", "0.006"],
        "npae_deg": ["0.025", "0.014"],
        "exchanges answered": ["100"],
        "not answered": ["14"],
        "latency, ms: half of them": ["50.5"],
        "99 %": ["99.01"],
        "slowest": ["100.0"],
        "ticks": ["58"],
        "ticks left out": ["3"],
        "longest time between two, s": ["0.4"],
        "refused count": ["11"],
        "clamped count": ["12"],
        "limited count": ["13"],
        "outlier": ["15"],
    }
    assert [name for name, row in expected.items() if row not in rows.get(name, [])] == []
    assert re.findall(r'<div class="tile"><b>(.*?)</b><span>(.*?)</span>', page) == [
        ("0.5", "of the readings acquired"),
        ("1", "losses, 1.0 s together"),
        ("0.5", "s, the longest relock"),
        ("0.66", "beamwidths off the path in losses, at most"),
        ("-1.234", "s along the track, ± 0.51"),
        ("0.0567", "° across, ± 0.26"),
        ("–", "° of residuals after the fit, rms"),
        ("99.01", "ms of an exchange, 99 %"),
    ]
