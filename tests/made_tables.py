"""CPF and SP3 files made for tests, from states that turn with the Earth."""

from collections.abc import Sequence

import numpy as np
from made_oems import States, states

from acu_daemon.model import EarthOrientation
from acu_daemon.orbit.frames import itrs_from_teme
from acu_daemon.orbit.timescales import unix_from_tai, utc_text

TURNED = EarthOrientation(ut1_utc_s=-0.11, polar_x_arcsec=0.02, polar_y_arcsec=0.35)
MJD_1970 = 40587


def earth_fixed(of: States) -> States:
    """The same states in ITRF, with an orientation that is not nothing."""
    tai_s, r_m, v_m_s = of
    return tai_s, *itrs_from_teme(r_m, v_m_s, tai_s, TURNED)


def made_states(span_s: float = 7200.0, step_s: float = 120.0) -> States:
    """States of the ISS by SGP4, Earth-fixed."""
    return earth_fixed(states(span_s, step_s))


def cpf_rows(of: States, leap_s: int = 0) -> list[str]:
    """Records 10, positions to a millimetre."""
    rows = []
    for tai_s, r_m in zip(of[0].tolist(), of[1].tolist(), strict=True):
        days, second = divmod(unix_from_tai(tai_s), 86400.0)
        rows.append(f"10 0 {MJD_1970 + int(days)} {second:13.6f} {leap_s:2d} " + " ".join(f"{x:17.3f}" for x in r_m))
    return rows


def cpf(of: States, version: int = 2, rows: Sequence[str] | None = None, frame: int = 0) -> str:
    """A prediction of the ISS as the ILRS would have it."""
    number = "0421  1" if version == 2 else "5421"
    return "\n".join(
        [
            f"H1 CPF  {version}  TST 2022  2 11 12 {number} iss        NONE",
            f"H2 9806701  9999 25544    2022  2 11 20  0  0 2022  2 11 22  0  0   120 1 1 {frame} 0 0 1",
            "H9",
            "00 a comment",
            *(cpf_rows(of) if rows is None else rows),
            "99",
            "",
        ]
    )


def sp3(
    orbits: dict[str, States],
    system: str = "UTC",
    letter: str = "c",
    frame: str = "ITR14",
    *,
    has_velocities: bool = True,
) -> str:
    """An SP3 file with these satellites."""
    tai_s = next(iter(orbits.values()))[0]
    shift_s = {"UTC": 0.0, "GPS": 18.0, "TAI": 37.0, "BDT": 4.0}[system]
    kind = "V" if has_velocities else "P"
    lines = [
        f"#{letter}{kind}2022  2 11 20  0  0.00000000 {tai_s.size:7d}   SLR {frame:>5} FIT TEST",
        "## 2196 504000.00000000   120.00000000 59621 0.8333333333333",
        f"+   {len(orbits):2d}   " + "".join(orbits),
        f"%c L  cc {system} ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc",
        "%c cc cc ccc ccc cccc cccc cccc cccc ccccc ccccc ccccc ccccc",
        "/* made for a test",
    ]
    for i, t in enumerate(tai_s.tolist()):
        date, _, clock = utc_text(t + shift_s, 8).removesuffix("Z").partition("T")
        (year, month, day), (hour, minute, second) = (
            map(float, text.split(sep)) for text, sep in ((date, "-"), (clock, ":"))
        )
        lines.append(f"*  {year:4.0f} {month:2.0f} {day:2.0f} {hour:2.0f} {minute:2.0f} {second:11.8f}")
        for name, (_, r_m, v_m_s) in orbits.items():
            lines.append(f"P{name}" + "".join(f"{x:14.6f}" for x in r_m[i] / 1e3) + " 999999.999999")
            if has_velocities:
                lines.append(f"V{name}" + "".join(f"{x:14.6f}" for x in v_m_s[i] * 10.0) + " 999999.999999")
    return "\n".join([*lines, "EOF", ""])


def worst_m(differences: np.ndarray) -> float:
    """The longest of vectors (N, 3)."""
    return float(np.linalg.norm(differences, axis=1).max())
