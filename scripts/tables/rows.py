"""Rows of the reproduced table: median and spread of each method beside the papers' figures, as text and as JSON."""

from dataclasses import dataclass

import numpy as np

from acu_daemon.units import Array
from tables.seed_figures import SeedPass, SeedRow
from tables.true_pass import TruePass


@dataclass(frozen=True, slots=True)
class Spread:
    """Of eps_max over the runs, degrees."""

    median_deg: float
    p05_deg: float
    p95_deg: float

    def holds(self, value_deg: float) -> bool:
        """Whether a value lies between 5 and 95 %, to the two decimals that the papers print."""
        return round(self.p05_deg, 2) <= value_deg <= round(self.p95_deg, 2)


@dataclass(frozen=True, slots=True)
class Row:
    """One row of the papers' tables, simulated."""

    seed_pass: SeedPass
    seed: SeedRow
    bound_deg: float
    methods: dict[str, Spread]

    def as_json(self) -> dict[str, object]:
        """The row as `--json` writes it."""
        return {
            "station": self.seed_pass.station,
            "pass": self.seed_pass.label,
            "used_s": self.seed.used_s,
            "seed_deterministic_deg": self.seed.deterministic_deg,
            "seed_kalman_deg": self.seed.kalman_deg,
            "bound_deg": round(self.bound_deg, 4),
            "methods": {
                name: {
                    "median_deg": round(one.median_deg, 4),
                    "p05_deg": round(one.p05_deg, 4),
                    "p95_deg": round(one.p95_deg, 4),
                }
                for name, one in self.methods.items()
            },
        }


def rows_of(true_pass: TruePass, eps_deg: dict[str, Array], bounds_deg: list[float]) -> list[Row]:
    """Make the rows of a pass from eps_max of each method, (runs, rows), and the bounds of the rows."""
    return [
        Row(
            true_pass.seed,
            seed,
            bounds_deg[k],
            {name: Spread(*np.percentile(eps[:, k], (50.0, 5.0, 95.0)).tolist()) for name, eps in eps_deg.items()},
        )
        for k, seed in enumerate(true_pass.seed.rows)
    ]


def table_text(rows: list[Row], methods: tuple[str, ...]) -> str:
    """The rows as a Markdown table, and below it how they compare."""
    names = ("pass", "s used", "paper det.", "paper Kalman", *methods, "bound")
    lines = ["| " + " | ".join(names) + " |", "|---" * len(names) + "|"]
    for row in rows:
        cells = [
            f"{row.seed_pass.station} {row.seed_pass.label}",
            f"{row.seed.used_s}",
            f"{row.seed.deterministic_deg:.2f}{_mark(row, 'deterministic', row.seed.deterministic_deg)}",
            f"{row.seed.kalman_deg:.2f}{_mark(row, 'kalman', row.seed.kalman_deg)}",
            *(_spread_text(row.methods[name]) for name in methods),
            f"{row.bound_deg:.2f}",
        ]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join([*lines, "", *summary(rows)])


def summary(rows: list[Row]) -> list[str]:
    """How many of the papers' figures lie in our spread, and how `full` compares with the best of them."""
    lines = []
    for name, figure in (("deterministic", "deterministic_deg"), ("kalman", "kalman_deg")):
        if name in rows[0].methods:
            count = sum(row.methods[name].holds(getattr(row.seed, figure)) for row in rows)
            lines.append(f"{name}: {count} of {len(rows)} of the papers' figures lie in our 5-95 % (! marks others)")
    bounds = _geometric_mean([row.bound_deg / row.seed.better_deg for row in rows])
    lines.append(f"bound over the papers' better method: geometric mean {bounds:.2f}")
    if "full" in rows[0].methods:
        full = [row.methods["full"] for row in rows]
        ratios = [one.median_deg / row.seed.better_deg for one, row in zip(full, rows, strict=True)]
        below = sum(one.p95_deg < row.seed.better_deg for one, row in zip(full, rows, strict=True))
        over_bound = _geometric_mean([one.median_deg / row.bound_deg for one, row in zip(full, rows, strict=True)])
        lines += [
            f"full over the papers' better method: geometric mean {_geometric_mean(ratios):.2f}, "
            f"largest {max(ratios):.2f}; its 95 % below it in {below} of {len(rows)} rows",
            f"full over the bound: geometric mean {over_bound:.2f}",
        ]
    return lines


def _mark(row: Row, name: str, value_deg: float) -> str:
    return "" if name not in row.methods or row.methods[name].holds(value_deg) else " !"


def _spread_text(one: Spread) -> str:
    return f"{one.median_deg:.2f} [{one.p05_deg:.2f}-{one.p95_deg:.2f}]"


def _geometric_mean(values: list[float]) -> float:
    return float(np.exp(np.mean(np.log(values))))
