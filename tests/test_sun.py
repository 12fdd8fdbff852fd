"""The sun against Skyfield 1.55 with the JPL ephemeris DE421, topocentric and apparent, UT1 taken as UTC."""

import numpy as np
import pytest

from acu_daemon.model import Site, Station
from acu_daemon.orbit.sun import sun_direction_deg
from acu_daemon.orbit.timescales import tai_from_utc

RIGHT_DEG = 0.001
SKYFIELD = [  # latitude, longitude, height in m; azimuth and geometric elevation
    (-15.53, -56.07, 277.0, "1989-02-01T02:00:00Z", 222.844, -46.2795),  # Cuiaba
    (78.23, 15.39, 450.0, "2026-06-21T12:00:00Z", 196.7295, 34.7637),  # Svalbard
    (64.97, -147.51, 135.0, "2026-11-30T21:30:00Z", 177.9479, 3.2615),  # Fairbanks
    (-72.01, 2.53, 1270.0, "2030-12-21T18:15:00Z", 256.1213, 20.1812),  # Troll
    (1.35, 103.82, 15.0, "2000-03-20T07:35:00Z", 268.1229, 54.2647),  # Singapore
    (36.99, -25.13, 276.0, "2024-09-22T12:44:00Z", 160.1438, 51.3075),  # Santa Maria
    (-15.53, -56.07, 277.0, "2026-08-18T16:00:00Z", 353.9476, 61.3769),  # Cuiaba
    (78.23, 15.39, 450.0, "1972-07-04T03:00:00Z", 55.7495, 16.5422),  # Svalbard
    (64.97, -147.51, 135.0, "2049-04-09T00:30:00Z", 224.8266, 26.3568),  # Fairbanks
    (-72.01, 2.53, 1270.0, "2040-01-01T09:00:00Z", 50.7079, 35.3633),  # Troll
    (1.35, 103.82, 15.0, "2026-03-01T05:10:00Z", 168.8644, 80.8936),  # Singapore
    (36.99, -25.13, 276.0, "2010-10-15T19:45:00Z", 265.8063, -8.9479),  # Santa Maria
]


@pytest.mark.parametrize(("latitude_deg", "longitude_deg", "height_m", "utc", "az_deg", "el_deg"), SKYFIELD)
def test_the_sun_is_where_skyfield_sees_it(
    latitude_deg: float, longitude_deg: float, height_m: float, utc: str, az_deg: float, el_deg: float
) -> None:
    site = Site(Station("", latitude_deg, longitude_deg, height_m))
    az, el = sun_direction_deg(np.array([tai_from_utc(utc)] * 2), site)
    assert az.shape == el.shape == (2,)
    assert (az[0] - az_deg) * np.cos(np.radians(el_deg)) == pytest.approx(0.0, abs=RIGHT_DEG)
    assert el[0] == pytest.approx(el_deg, abs=RIGHT_DEG)
