"""The mount's terms and the antenna model: signs, inverses, partials, the zenith, and a pedestal made of rotations."""

from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from acu_daemon.model import Station
from acu_daemon.pointing.antenna_model import STATES, AntennaModel
from acu_daemon.pointing.mount import MOST_DEG, TERMS, Mount
from acu_daemon.pointing.refraction import traced
from acu_daemon.sim.mount_axes import MountAxes
from acu_daemon.units import DEG, wrap_180

INVERSE_DEG = 1e-8
STEEPEST = 1000.0  # degrees of azimuth by degrees of elevation, for a degree of terms, at the zenith
STATION = Station("there", 45.0, 0.0, 300.0)
MOUNT = Mount(0.31, -0.12, 0.03, 0.02, 0.015, -0.025, 0.04)
MODEL = AntennaModel(MOUNT, traced(330.0, STATION), 1.08)
TERM = st.floats(-0.1, 0.1)
MOUNTS = st.builds(Mount, st.floats(-5.0, 5.0), st.floats(-5.0, 5.0), TERM, TERM, TERM, TERM, TERM)
AZIMUTHS, ELEVATIONS = st.floats(-270.0, 540.0), st.floats(-3.0, 183.0)


@pytest.mark.parametrize(
    ("term", "az_deg", "el_deg", "azimuth_by", "elevation_by"),
    [
        ("ia_deg", 10.0, 40.0, 0.1, 0.0),
        ("ie_deg", 10.0, 40.0, 0.0, 0.1),
        ("ca_deg", 10.0, 60.0, 0.2, 0.0),  # the beam lies left of the dish's axis, which must turn right, by sec h
        ("npae_deg", 10.0, 45.0, 0.1, 0.0),
        ("an_deg", 0.0, 45.0, 0.0, 0.1),  # the axis leans north: the encoder reads high there
        ("an_deg", 90.0, 45.0, 0.1, 0.0),
        ("aw_deg", 270.0, 45.0, 0.0, 0.1),  # the axis leans west
        ("aw_deg", 0.0, 45.0, 0.1, 0.0),
        ("tf_deg", 10.0, 60.0, 0.0, 0.05),  # the beam sags below what the encoder shows
    ],
)
@pytest.mark.parametrize("kind", [Mount, MountAxes])
def test_a_term_moves_the_encoders_as_defined(kind, term, az_deg, el_deg, azimuth_by, elevation_by) -> None:
    az, el = kind(**{term: 0.1}).encoders_deg(az_deg, el_deg)
    assert wrap_180(float(az) - az_deg) == pytest.approx(azimuth_by, abs=3e-4)
    assert float(el) - el_deg == pytest.approx(elevation_by, abs=3e-4)


@given(st.tuples(*[st.floats(-1.0, 1.0)] * 7), AZIMUTHS, st.floats(0.0, 80.0), st.sampled_from([0.01, 0.05, 0.1]))
def test_a_pedestal_of_rotations_differs_by_the_square_of_the_terms(units, az_deg, el_deg, size_deg) -> None:
    terms = [size_deg * unit for unit in units]
    az, el = Mount(*terms).encoders_deg(az_deg, el_deg)
    true_az, true_el = MountAxes(*terms).encoders_deg(az_deg, el_deg)
    square_deg = DEG * size_deg * size_deg
    secant = 1.0 / np.cos(el_deg * DEG)
    left_out_deg = 3.0 * size_deg * 1.9e-5 * secant**3  # of the first order, by the bound at the zenith
    assert abs(float(az) - true_az) / secant < 12.0 * square_deg * secant + left_out_deg
    assert abs(float(el) - true_el) < 8.0 * square_deg * secant + left_out_deg


@given(st.builds(MountAxes, *[TERM] * 7), AZIMUTHS, st.floats(-10.0, 88.0))
def test_the_pedestal_of_rotations_points_where_its_encoders_were_sent(axes, az_deg, el_deg) -> None:
    encoder_az, encoder_el = axes.encoders_deg(az_deg, el_deg)
    az, el = axes.beam_deg(encoder_az, encoder_el)
    assert wrap_180(az - az_deg) == pytest.approx(0.0, abs=1e-8)
    assert el == pytest.approx(el_deg, abs=1e-9)


@given(MOUNTS, AZIMUTHS, ELEVATIONS, st.floats(4e5, 4e6), st.floats(0.7, 1.3))
def test_encoders_and_back_is_the_same_direction(mount, az_deg, el_deg, range_m, scale) -> None:
    """Beyond the zenith it comes back as the sky's: the azimuth half a turn on, the elevation 180 deg less."""
    assume(sum(abs(term) for term in mount.terms_deg()[2:6]) <= MOST_DEG)
    model = AntennaModel(mount, MODEL.refraction, scale)
    az, el = model.geometric_deg(*model.encoders_deg(az_deg, el_deg, range_m), range_m)
    is_folded = el_deg > 90.0
    if abs(el_deg - 90.0) <= INVERSE_DEG:  # either side of the zenith is the same direction there
        is_folded = float(az) > az_deg + 90.0
    assert float(az) == pytest.approx(az_deg + 180.0 if is_folded else az_deg, abs=INVERSE_DEG)
    assert float(el) == pytest.approx(180.0 - el_deg if is_folded else el_deg, abs=INVERSE_DEG)


@pytest.mark.parametrize("el_deg", [-3.0, 0.0, 45.0, 89.9, 90.0, 90.1, 135.0, 180.0, 183.0])
def test_air_counts_from_the_horizon_on_either_side_of_the_zenith(el_deg) -> None:
    """Refraction is of the true elevation: a plunged antenna at 175 deg looks through the air of 5 deg."""
    _, el = MODEL.encoders_deg(10.0, el_deg, 1e6)
    assert float(el) == pytest.approx(float(MODEL.mount.encoders_deg(10.0, _in_air(el_deg))[1]), abs=1e-9)


def _in_air(el_deg: float) -> float:
    if el_deg > 90.0:
        return 180.0 - _in_air(180.0 - el_deg)
    return float(MODEL.refraction.apparent_el_deg(el_deg, 1e6, MODEL.refraction_scale))


@pytest.mark.long
@given(AZIMUTHS, ELEVATIONS, st.floats(4e5, 4e6))
def test_the_partials_are_those_of_differences(az_deg, el_deg, range_m) -> None:
    h = 1e-4
    az, el, partials = MODEL.with_partials(az_deg, el_deg, range_m)
    assert (float(az), float(el)) == pytest.approx(MODEL.encoders_deg(az_deg, el_deg, range_m), abs=1e-9)

    def slope(more: AntennaModel, less: AntennaModel, az_step: float = 0.0, el_step: float = 0.0) -> np.ndarray:
        up = np.array(more.encoders_deg(az_deg + az_step, el_deg + el_step, range_m))
        down = np.array(less.encoders_deg(az_deg - az_step, el_deg - el_step, range_m))
        return (up - down) / (2.0 * h)

    near = 1e-3 + 1e-3 * np.abs(partials.by_direction).max()
    assert partials.by_direction[:, 0] == pytest.approx(slope(MODEL, MODEL, az_step=h), abs=near)
    assert partials.by_direction[:, 1] == pytest.approx(slope(MODEL, MODEL, el_step=h), abs=near)
    for i, name in enumerate(TERMS):
        changed = [
            replace(MODEL, mount=replace(MOUNT, **{name: getattr(MOUNT, name) + d}))
            for d in (h, -h)
        ]  # fmt: skip
        assert partials.by_state[:, i] == pytest.approx(slope(*changed), abs=1e-6)
    scaled = [replace(MODEL, refraction_scale=MODEL.refraction_scale + d) for d in (h, -h)]
    assert partials.by_state[:, STATES.index("refraction_scale")] == pytest.approx(slope(*scaled), abs=near)


def test_arrays_give_what_their_points_give() -> None:
    az_deg, el_deg, range_m = np.linspace(0, 350, 9), np.linspace(-1, 89, 9), np.linspace(3e6, 6e5, 9)
    az, el, partials = MODEL.with_partials(az_deg, el_deg, range_m)
    assert partials.by_direction.shape == (9, 2, 2)
    assert partials.by_state.shape == (9, 2, len(STATES))
    for i in range(9):
        one_az, one_el, one = MODEL.with_partials(az_deg[i], el_deg[i], range_m[i])
        assert (float(one_az), float(one_el)) == pytest.approx((az[i], el[i]), abs=1e-7)
        assert partials.by_state[i] == pytest.approx(one.by_state, abs=1e-6)


@settings(max_examples=25)
@given(MOUNTS, AZIMUTHS)
def test_through_the_zenith_the_encoders_stay_within_bounds_and_make_no_step(mount, az_deg) -> None:
    el_deg = np.linspace(85.0, 95.0, 2001)
    az, el = mount.encoders_deg(np.full(2001, az_deg), el_deg)
    sideways = sum(abs(term) for term in mount.terms_deg()[2:6])
    assert np.abs(az - az_deg - mount.ia_deg).max() <= 115.0 * sideways
    assert np.abs(np.diff(az)).max() < STEEPEST * 0.005 * sideways + 1e-9
    left_out = (az - az_deg - mount.ia_deg) * np.cos(el_deg * DEG)  # of the way across on the sky
    assert np.abs(left_out).max() <= sideways + 1e-9
    assert float(el[1000]) == pytest.approx(float(mount.encoders_deg(az_deg, 90.0)[1]), abs=1e-9)


def test_a_square_mount_in_a_vacuum_reads_the_direction() -> None:
    az, el = AntennaModel().encoders_deg(123.4, 56.7)
    assert (float(az), float(el)) == (123.4, 56.7)
    assert {field.name for field in fields(MountAxes)} == set(TERMS)


@pytest.mark.parametrize("model", [AntennaModel(), MODEL, AntennaModel(MOUNT)])
@pytest.mark.parametrize("is_plunged", [False, True])
@pytest.mark.parametrize(("az_rate", "el_rate"), [(0.8, 0.5), (-0.8, 0.5), (0.8, -0.5), (-0.8, -0.5)])
def test_rates_are_those_at_which_the_angles_move_plunged_or_not(model, is_plunged, az_rate, el_rate) -> None:
    step_s, range_m = 0.01, np.full(2, 9e5)
    times = np.array([-0.5, 0.5]) * step_s
    turned = model.with_rates_plunged if is_plunged else model.with_rates
    az, el, _, _ = turned(
        40.0 + az_rate * times, 70.0 + el_rate * times, range_m, np.full(2, az_rate), np.full(2, el_rate)
    )
    one = [np.array([value]) for value in (40.0, 70.0, 9e5, az_rate, el_rate)]
    middle_az, middle_el, found_az, found_el = turned(*one)
    assert wrap_180(float(az[1] - az[0])) / step_s == pytest.approx(float(found_az[0]), abs=1e-4)
    assert float(el[1] - el[0]) / step_s == pytest.approx(float(found_el[0]), abs=1e-4)
    assert (float(middle_el[0]) > 90.0) == is_plunged
    assert abs(wrap_180(float(middle_az[0]) - (220.0 if is_plunged else 40.0))) < 1.0
