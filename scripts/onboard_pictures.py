"""Draw the pictures of docs/onboard.md: the frames, and the example pass by `acu-daemon onboard profile`.

scripts/onboard_pictures.py            writes docs/pictures/onboard-frames.png and onboard-pass.png
"""

import subprocess
import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

TOP = Path(__file__).resolve().parents[1]
PICTURES = TOP / "docs" / "pictures"
FRAME, BODY, BEAM, EARTH = "#3d7ea6", "#c8553d", "#0b6e4f", "#9aa5b1"


def main() -> None:
    mpl.rcParams.update({"font.size": 10})
    figure = Figure(figsize=(13.0, 3.9), dpi=110, layout="constrained")
    for axes, draw in zip(figure.subplots(1, 4), (_from_the_side, _from_behind, _azimuth, _elevation), strict=True):
        axes.set_aspect("equal")
        axes.axis("off")
        axes.set_xlim(-1.45, 1.45)
        axes.set_ylim(-1.6, 1.3)
        draw(axes)
    figure.savefig(PICTURES / "onboard-frames.png")
    subprocess.run(
        [sys.executable, "-m", "acu_daemon", "onboard", "profile", "config/onboard/pass.toml", "--plot",
         "docs/pictures/onboard-pass.png"],
        cwd=TOP, check=True,
    )  # fmt: skip


def _arrow(axes: Axes, angle_deg: float, text: str, colour: str, length: float = 1.0, style: str = "-") -> None:
    """From the origin; angle from the right, counterclockwise."""
    x, y = length * np.cos(np.radians(angle_deg)), length * np.sin(np.radians(angle_deg))
    axes.annotate(
        "", (x, y), (0, 0), arrowprops={"arrowstyle": "-|>", "color": colour, "linestyle": style, "linewidth": 1.6}
    )
    axes.text(1.25 * x, 1.2 * y, text, color=colour, ha="center", va="center")


def _arc(axes: Axes, first_deg: float, last_deg: float, text: str, radius: float = 0.6) -> None:
    """A turn with its name, from the first angle to the last."""
    angles = np.radians(np.linspace(first_deg, last_deg, 40))
    axes.plot(radius * np.cos(angles), radius * np.sin(angles), color="#444444", linewidth=1.0)
    tip, before = angles[-1], angles[-4]
    axes.annotate(
        "",
        (radius * np.cos(tip), radius * np.sin(tip)),
        (radius * np.cos(before), radius * np.sin(before)),
        arrowprops={"arrowstyle": "-|>", "color": "#444444"},
    )
    middle = angles[20]
    axes.text(1.3 * radius * np.cos(middle), 1.3 * radius * np.sin(middle), text, ha="center", va="center")


def _earth(axes: Axes) -> None:
    angles = np.radians(np.linspace(50, 130, 60))
    axes.fill(np.append(2.0 * np.cos(angles), 0), np.append(-3.35 + 2.0 * np.sin(angles), -2.0), color=EARTH, alpha=0.5)
    axes.text(0.0, -1.5, "Earth", ha="center")


def _from_the_side(axes: Axes) -> None:
    axes.set_title("LVLH from the right of the flight")
    _earth(axes)
    _arrow(axes, 0, "x\nforward", FRAME)
    _arrow(axes, -90, "z", FRAME)
    _arrow(axes, -50, "body +Z", BODY, 1.05, "--")
    _arc(axes, -90, -50, "pitch +", 0.6)
    axes.plot(0, 0, "o", color=FRAME)
    axes.text(-0.1, 0.15, "y towards you (right)", color=FRAME, ha="center")


def _from_behind(axes: Axes) -> None:
    axes.set_title("LVLH from behind, along x")
    _earth(axes)
    _arrow(axes, 0, "y\nright", FRAME)
    _arrow(axes, -90, "z", FRAME)
    _arrow(axes, -130, "body +Z", BODY, 1.05, "--")
    _arc(axes, -90, -130, "roll +", 0.6)
    axes.plot(0, 0, "x", color=FRAME)
    axes.text(0.0, 0.15, "x away from you", color=FRAME, ha="center")


def _azimuth(axes: Axes) -> None:
    axes.set_title("gimbal, +Z away from you")
    _arrow(axes, 90, "+X", FRAME)
    _arrow(axes, 0, "+Y", FRAME)
    _arrow(axes, 35, "p", BEAM)
    _arc(axes, 90, 35, "azimuth")
    axes.text(0.0, -0.9, "azimuth = atan2(p_y, p_x)", ha="center")


def _elevation(axes: Axes) -> None:
    axes.set_title("gimbal, in the plane of Z and p")
    _arrow(axes, -90, "+Z  (nadir)", FRAME)
    _arrow(axes, -40, "p", BEAM)
    _arc(axes, -90, -40, "elevation")
    axes.text(0.0, 0.5, "elevation = angle FROM +Z:\n0 along the axis,\nabout 64 at the horizon", ha="center")


if __name__ == "__main__":
    main()
