"""The memory of the mount in words: its terms, the swing of a day, the last passes, what to put into station.toml."""

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from acu_daemon.assist.estimators.full.pedestal_prior import PEDESTAL_TERMS
from acu_daemon.assist.mount_memory.mount_fit import FittedPass
from acu_daemon.assist.mount_memory.pedestal_memory import a_priori_sigmas
from acu_daemon.assist.settings import EstimatorSettings
from acu_daemon.edge.mount_memory_file import PassRow
from acu_daemon.report.mount_text import SHOWN_PASSES, pass_lines, residual_lines, terms_lines, toml_lines
from acu_daemon.units import DEG

SETTINGS = EstimatorSettings(bias_sigma_azimuth_deg=0.5, bias_sigma_elevation_deg=0.4, bias_sigma_azimuth_sec_deg=0.0)
BEFORE = a_priori_sigmas(SETTINGS)


def memory(
    *, has_mount: bool = True, is_still: bool = False, share: float = 0.25, swings_deg: Any = (0, 0, 0, 0), **more: Any
) -> Any:
    """Terms of -0.1, 0.1, 0.3, ... deg, each known to a share of what was known before any pass."""
    terms_deg = -0.1 + 0.2 * np.arange(8)
    now = share * BEFORE[int(has_mount)]
    terms = SimpleNamespace(mean=terms_deg * DEG, covariance=np.diag(now**2))
    chosen = SimpleNamespace(terms=terms, mean=np.concatenate([terms_deg, swings_deg]) * DEG)
    given = {"evidence": 4.26, "still_evidence": 5.04} | more
    return SimpleNamespace(has_mount=has_mount, is_still=is_still, chosen=chosen, **given)


@pytest.mark.parametrize(("has_mount", "which"), [(True, "all terms predict"), (False, "IA, CA, IE and RF predict")])
def test_first_stands_which_terms_predict_and_how_much_likelier_they_are(has_mount: bool, which: str) -> None:
    first, heads, *_ = terms_lines(memory(has_mount=has_mount), SETTINGS)
    assert first == (
        f"{which}: the passes are likelier with NPAE, AN, AW and TF by 4.3 in the logarithm (from 3 on they predict)"
    )
    assert heads.split() == ["term", "deg", "sigma", "before", "any", "pass"]


@pytest.mark.parametrize("has_mount", [True, False])
@pytest.mark.parametrize(
    ("share", "word"), [(0.25, "told by the data"), (0.5, "told by the data"), (0.501, "hardly told by the data")]
)
def test_each_term_that_may_move_has_its_line(has_mount: bool, share: float, word: str) -> None:
    lines = terms_lines(memory(has_mount=has_mount, share=share * (1.0 - 1e-12)), SETTINGS)
    told = {line.split()[0]: line for line in lines if line.split()[0] in PEDESTAL_TERMS and "by day" not in line}
    before = BEFORE[int(has_mount)] / DEG
    assert list(told) == [name for name, one in zip(PEDESTAL_TERMS, before, strict=True) if one > 0.0]
    assert ("CA" in told) == has_mount
    for name, line in told.items():
        k = PEDESTAL_TERMS.index(name)
        figures, said = line[5:32].split(), line[35:]
        assert figures == [f"{-0.1 + 0.2 * k:+.4f}", f"{share * before[k]:.4f}", f"{before[k]:.4f}"]
        assert said == word


def test_zero_points_that_hold_still_say_so_in_place_of_their_swing() -> None:
    assert terms_lines(memory(is_still=True), SETTINGS)[-2:] == [
        "beyond [mount]; RF: what the refraction is off the one told, at 45 deg of elevation",
        "IA and IE hold still: likelier by 5.0 than that they move by the day",
    ]


@pytest.mark.parametrize(
    ("cosine", "sine", "utc_h"),
    [(1.0, 0.0, 12), (0.0, 1.0, 18), (-1.0, 0.0, 0), (0.0, -1.0, 6), (1.0, -1e-9, 12), (-0.99692, 0.07846, 0)],
)
def test_a_swing_has_its_amplitude_and_hour_by_utc(cosine: float, sine: float, utc_h: int) -> None:
    swings_deg = (0.02 * cosine, 0.02 * sine, 0.03 * sine, 0.04 * cosine)
    ia, ie = terms_lines(memory(swings_deg=swings_deg), SETTINGS)[-2:]
    assert ia == f"IA by day and night: +-0.0200 deg, highest at {utc_h} h UTC"
    assert ie.startswith(f"IE by day and night: +-{np.hypot(swings_deg[2], swings_deg[3]):.4f} deg, highest at ")


def test_a_zero_point_that_is_not_estimated_does_not_swing() -> None:
    fixed = EstimatorSettings(bias_sigma_azimuth_deg=0.0, bias_sigma_elevation_deg=0.4)
    swings = [line.split()[0] for line in terms_lines(memory(), fixed) if "by day and night" in line]
    assert swings == ["IE"]


# For station.toml


@pytest.mark.parametrize("has_mount", [True, False])
def test_what_is_put_into_the_file_is_what_is_there_and_what_was_found_together(has_mount: bool) -> None:
    keys = ("ia", "ca", "ie", "npae", "an", "aw", "tf")
    given_deg = {f"{key}_deg": 1.0 + k for k, key in enumerate(keys)}
    head, *lines = toml_lines(memory(has_mount=has_mount), SETTINGS, given_deg)
    assert head == "[mount]"
    expected = []
    for k, name in enumerate(PEDESTAL_TERMS):
        before, key = BEFORE[int(has_mount)][k] / DEG, name.lower()
        if before > 0.0 and key in keys:  # RF is none of [mount]
            expected.append(f"{key}_deg = {given_deg[f'{key}_deg'] - 0.1 + 0.2 * k:.4f}")
            expected.append(f"{key}_sigma_deg = {0.25 * before:.4f}")
    assert lines == expected
    assert len(lines) >= 4


def test_what_the_data_hardly_tell_is_left_out() -> None:
    assert toml_lines(memory(share=0.6), SETTINGS, {}) == ["[mount]"]


# Passes


def row(k: int, what: str = "") -> PassRow:
    return PassRow(f"2026-08-{k:02}T12:00:00Z", f"S{k}", 0.1234, -0.2345, 0.0126, 0.0236, what)


def test_the_last_ten_passes_are_shown_with_both_zero_points() -> None:
    assert SHOWN_PASSES == 10
    head, *lines = pass_lines([row(k) for k in range(1, 13)])
    assert head.split() == ["pass", "IA,", "deg", "IE,", "deg", "satellite"]
    assert [line.split()[0] for line in lines] == [f"2026-08-{k:02}T12:00:00Z" for k in range(3, 13)]
    assert lines[0].split()[1:] == ["+0.123", "+-", "0.013", "-0.234", "+-", "0.024", "S3"]
    assert [head.index(word) for word in ("IA", "IE", "satellite")] == [
        lines[0].index(word) for word in ("+0.123", "-0.234", "S3")
    ]
    assert pass_lines([row(1, "left out: noisy")])[1].endswith("S1   left out: noisy")
    assert pass_lines([]) == [head]


@pytest.mark.parametrize("why_not", ["", "noisy"])
def test_what_each_pass_leaves_is_told_across_and_in_elevation_before_and_after(why_not: str) -> None:
    before, after = np.array([[3.0, -4.0], [0.1, -0.1]]), np.array([[0.3, 0.4], [0.01, 0.01]])
    nothing = np.zeros(2)
    _, line = residual_lines([FittedPass("pass 7", why_not, nothing, nothing, before, after)])
    said = line.split()
    assert said[:4] == [f"{np.sqrt(12.5):.4f}", f"{np.sqrt(0.125):.4f}", "0.1000", "0.0100"]
    assert line.endswith("   pass 7" + ("   left out: noisy" if why_not else ""))
