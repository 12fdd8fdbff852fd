"""All passes of a station on one page, with the figures that drift from pass to pass.  Pure."""

from collections.abc import Sequence
from html import escape
from typing import Any

from acu_daemon.report.page_parts import page, table, text
from acu_daemon.report.pass_page import verdict_of
from acu_daemon.report.svg_chart import sparkline

DRIFTING = (  # key of a row, what it is called
    ("bias_az_deg", "bias of the azimuth, °"),
    ("bias_el_deg", "bias of the elevation, °"),
    ("along_s", "correction along the track, s"),
    ("across_deg", "correction across, °"),
    ("residual_rms_deg", "residuals after the fit, ° rms"),
    ("longest_relock_s", "longest relock, s"),
    ("off_path_beamwidths", "off the path in losses, beamwidths"),
    ("latency_p99_ms", "latency, 99 %, ms"),
)
MOST_ROWS = 2000  # of the newest reports


def index_figures(reports: Sequence[tuple[str, dict[str, Any]]]) -> dict[str, Any]:
    """A row for each report, by name, the oldest first."""
    rows = [_row(name, figures) for name, figures in reports]
    rows.sort(key=lambda row: row["rise_utc"] or "")
    stations = sorted({row["station"] for row in rows})
    return {"format": 1, "stations": stations, "passes": rows}


def _row(name: str, figures: dict[str, Any]) -> dict[str, Any]:
    about, outcome, plan = figures["pass"], figures["outcome"], figures["plan"] or {}
    correction, after = figures["correction"] or {}, figures["residuals"]["after"] or {}
    biases = {one["name"]: one["value_deg"] for one in figures["biases"]}
    said, level = verdict_of(figures)
    return {
        "name": name,
        "station": about["station"],
        "satellite": about["satellite"],
        "is_rehearsal": about["is_rehearsal"],
        "rise_utc": plan.get("rise_utc") or outcome["begun_utc"],
        "highest_el_deg": plan.get("culmination_el_deg"),
        "verdict": said,
        "level": level,
        "acquired_share": outcome["acquired_share"],
        "loss_count": outcome["loss_count"],
        "lost_s": outcome["lost_s"],
        "longest_relock_s": outcome["longest_relock_s"],
        "off_path_beamwidths": outcome["largest_off_path_in_losses_beamwidths"],
        "along_s": correction.get("along_s"),
        "across_deg": correction.get("across_deg"),
        "bias_az_deg": biases.get("az_deg"),
        "bias_el_deg": biases.get("el_deg"),
        "residual_rms_deg": after.get("rms_deg"),
        "latency_p99_ms": figures["latency"].get("p99_ms"),
        "refused_count": len(figures["refused"]),
    }


def index_page(index: dict[str, Any]) -> str:
    """The page of the station's passes, the newest first."""
    rows = index["passes"]
    drifts = [
        (
            escape(what),
            sparkline(what, [row[key] for row in rows]),
            *(text(value) for value in _ends([row[key] for row in rows])),
        )
        for key, what in DRIFTING
    ]
    heads = (
        "UTC",
        "satellite",
        "highest °",
        "",
        "acquired",
        "losses",
        "lost s",
        "relock s",
        "off path",
        "along s",
        "across °",
        "refused",
    )
    lines = [
        (
            f'<a href="{escape(row["name"])}.html">{escape((row["rise_utc"] or "")[:16].replace("T", " "))}</a>',
            escape(row["satellite"]) + (" (rehearsal)" if row["is_rehearsal"] else ""),
            text(row["highest_el_deg"]),
            f'<span class="verdict {row["level"]}">{escape(row["verdict"])}</span>',
            *(
                text(row[key])
                for key in (
                    "acquired_share", "loss_count", "lost_s", "longest_relock_s", "off_path_beamwidths", "along_s",
                    "across_deg", "refused_count",
                )
            ),
        )
        for row in reversed(rows)
    ]  # fmt: skip
    where = ", ".join(index["stations"])
    body = (
        f'<h1>Passes of {escape(where)}</h1><p class="dim">{len(rows)} passes; what is off the path is in beamwidths, '
        "what is acquired a share of the readings.</p><h2>What drifts</h2>"
        f"{table(('', 'from pass to pass', 'first', 'last'), drifts, (2, 3))}"
        f"<h2>Passes</h2>{table(heads, lines, (2, 4, 5, 6, 7, 8, 9, 10, 11))}"
    )
    return page(f"Passes of {where}", body)


def _ends(values: Sequence[float | None]) -> tuple[float | None, float | None]:
    known = [one for one in values if one is not None]
    return (known[0], known[-1]) if known else (None, None)
