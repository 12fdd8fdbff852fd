"""A picture of the real passes: the worst error of the unseen half, for every draw of the noise."""

from pathlib import Path

import matplotlib as mpl
import numpy as np
from matplotlib.figure import Figure

from tables.trials import ASKED_WORST_DEG, Trial

_COLOURS = ("#0b6e4f", "#c8553d")


def plot_passes(path: Path, cases: dict[str, list[Trial]]) -> None:
    """One lane for each pass and case, the bound's median to 95 % behind it; writes a PNG."""
    names = sorted({one.name for trials in cases.values() for one in trials})
    with mpl.rc_context({"font.size": 9}):
        figure = Figure(figsize=(9.0, 0.42 * len(names) + 1.4), dpi=110, layout="constrained")
        axes = figure.add_subplot()
        for lane, colour, (label, trials) in zip((-0.18, 0.18), _COLOURS, cases.items(), strict=True):
            for k, name in enumerate(names):
                of_pass = [one for one in trials if one.name == name]
                bound = [
                    float(np.median([getattr(one, key) for one in of_pass])) for key in ("bound_deg", "bound_95_deg")
                ]
                texts = (label, "bound: median to 95 %" if lane < 0 else None) if k == 0 else (None, None)
                axes.plot(bound, [k + lane] * 2, color="#b9c2ca", linewidth=5, solid_capstyle="butt", label=texts[1])
                worst_deg = [one.worst_deg for one in of_pass]
                axes.plot(worst_deg, [k + lane] * len(worst_deg), ".", color=colour, alpha=0.7, label=texts[0])
        axes.axvline(ASKED_WORST_DEG, color="#444444", linestyle="--", linewidth=1)
        axes.set_yticks(range(len(names)), names)
        axes.set_ylim(len(names) - 0.5, -0.5)
        axes.set_xlim(left=0.0)
        axes.grid(axis="x", color="#dddddd")
        axes.set_xlabel("worst angle on the sky in the unseen half, degrees (dashed: asked)")
        axes.legend(loc="lower center", bbox_to_anchor=(0.4, 1.0), ncols=3, frameon=False)
        figure.savefig(path)
