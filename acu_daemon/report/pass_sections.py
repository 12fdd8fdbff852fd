"""The sections of a pass's report that are drawn: course, residuals, correction, line.  Pure."""

from collections.abc import Sequence
from html import escape

from acu_daemon.control.tracking.state_table import AUTOTRACKING, HOLDING, TrackState
from acu_daemon.report.page_parts import Figures, or_none, table, text, time_of_day
from acu_daemon.report.svg_chart import ChartBand, ChartLine, chart

HALF_BEAM = 0.5


def _kind(state: str) -> str:
    track = TrackState(state)
    if track in AUTOTRACKING:
        return "auto"
    return "hold" if track in HOLDING or track is TrackState.ZENITH else "search" if "SEARCH" in state else "other"


def _bands(figures: Figures) -> list[ChartBand]:
    return [
        ChartBand(one["t_s"], one["t_s"] + one["lasted_s"], _kind(one["state"]), f"{one['state']}, {one['lasted_s']} s")
        for one in figures["states"]
    ]


def _zero_s(figures: Figures) -> float:
    """Seconds of the day at which the curves' time is zero."""
    utc = figures["curves"]["zero_utc"]
    return float(3600 * int(utc[11:13]) + 60 * int(utc[14:16])) + float(utc[17:].removesuffix("Z"))


def course_section(figures: Figures) -> str:
    """State, distance from the path, elevation, level over the pass."""
    curves = figures["curves"]
    if not curves:
        return ""
    off, level, path = curves["off_path"], curves["level"], curves["path"]
    base: Figures = {"bands": _bands(figures), "zero_s_of_day": _zero_s(figures), "span_s": _span(path["t_s"])}
    distance = chart(
        "Distance from the path in beamwidths",
        "beamwidths off the path",
        [
            ChartLine("3 sigma of the prediction", off["t_s"], _times(off["sigma_beamwidths"], 3.0), "b"),
            ChartLine("off the path", off["t_s"], _held(off["beamwidths"]), "a"),
        ],
        marks=[(HALF_BEAM, "half the beam")],
        from_zero=True,
        **base,
    )
    elevation = chart(
        "Elevation", "elevation °", [ChartLine("elevation", path["t_s"], path["el_deg"], "a")], height=130.0, **base
    )
    signal = ""
    if any(one is not None for one in level["db"]):
        signal = chart(
            "Signal level", "level dB", [ChartLine("level", level["t_s"], level["db"], "a")], height=130.0, **base
        )
    key = (
        '<p class="dim"><span class="key auto"></span>autotrack<span class="key hold"></span>held on the prediction'
        '<span class="key search"></span>search<span class="key other"></span>other'
        '<span class="key a"></span>off the path<span class="key b"></span>3 sigma of the prediction</p>'
    )
    rows = [(time_of_day(one["utc"]), escape(one["state"]), text(one["lasted_s"])) for one in figures["states"]]
    states = table(("UTC", "state", "for s"), rows, (2,))
    return f"<h2>Course</h2>{distance}{key}{elevation}{signal}<h3>States</h3>{states}"


def _span(t_s: Sequence[float]) -> tuple[float, float]:
    return min(t_s), max(t_s)


def _times(values: Sequence[float | None], factor: float, most: float = 3.0) -> list[float | None]:
    return [None if one is None or one * factor > most else one * factor for one in values]


def _held(values: Sequence[float | None], most: float = 3.0) -> list[float | None]:
    """Far from the path, as before the pass, a curve would only flatten the rest."""
    return [None if one is None or one > most else one for one in values]


def residuals_section(figures: Figures) -> str:
    """Fitted readings against elements and fit, and what the gate left out."""
    found, gate = figures["residuals"], figures["gate"]
    parts = ["<h2>Residuals</h2>"]
    rows = []
    for name, what in (("before", "against the elements"), ("after", "against the last fit")):
        one = found[name]
        if one is None:
            continue
        rows.append(
            (
                what,
                *(
                    text(one[key])
                    for key in ("rms_deg", "largest_deg", "mean_cross_elevation_deg", "mean_elevation_deg")
                ),
            )
        )
        curve = one["curve"]
        parts.append(
            f"<h3>{what.capitalize()}</h3>"
            + chart(
                f"Residuals {what}",
                "°",
                [
                    ChartLine("cross elevation", curve["t_s"], curve["cross_elevation_deg"], "a", has_dots=True),
                    ChartLine("elevation", curve["t_s"], curve["elevation_deg"], "b", has_dots=True),
                ],
                zero_s_of_day=_zero_s(figures),
                span_s=_span(figures["curves"]["path"]["t_s"]),
                height=150.0,
            )
        )
    parts.append('<p class="dim"><span class="key a"></span>cross elevation<span class="key b"></span>elevation</p>')
    heads = (
        f"{text(found['reading_count'])} readings fitted",
        "rms °",
        "largest °",
        "mean cross °",
        "mean elevation °",
    )
    parts.append(table(heads, rows, (1, 2, 3, 4)) if rows else "<p>No reading was fitted.</p>")
    left_out = [(escape(reason), text(count)) for reason, count in gate["left_out"].items()]
    parts.append("<h3>Readings left out, and why</h3>")
    parts.append(table(("reason", "readings"), left_out, (1,)) if left_out else "<p>None.</p>")
    if gate["reset_count"]:
        parts.append(f"<p>What was fitted gave way to newer readings {text(gate['reset_count'])} times.</p>")
    return "".join(parts)


def correction_section(figures: Figures) -> str:
    """What the fit added to the elements, and the biases."""
    found, curve = figures["correction"], figures["curves"].get("correction")
    if found is None or curve is None:
        return "<h2>Correction and biases</h2><p>Nothing was fitted.</p>"
    base: Figures = {
        "zero_s_of_day": _zero_s(figures),
        "span_s": _span(figures["curves"]["path"]["t_s"]),
        "height": 150.0,
    }
    along = chart(
        "Correction along the track",
        "s along",
        [ChartLine("along", curve["t_s"], curve["along_s"], "a", curve["along_sigma_s"])],
        **base,
    )
    across = chart(
        "Correction across the track",
        "° across",
        [ChartLine("across", curve["t_s"], curve["across_deg"], "b", curve["across_sigma_deg"])],
        **base,
    )
    rows = [
        ("along the track, s", text(found["along_s"]), text(found["along_sigma_s"])),
        ("across the track, °", text(found["across_deg"]), text(found["across_sigma_deg"])),
        ("node, °", text(found["raan_deg"]), text(found["raan_sigma_deg"])),
        ("mean anomaly, °", text(found["mean_anomaly_deg"]), text(found["mean_anomaly_sigma_deg"])),
        ("inclination, °", text(found["inclination_deg"]), text(found["inclination_sigma_deg"])),
    ]
    biases = [(escape(one["name"]), text(one["value_deg"]), text(one["sigma_deg"])) for one in figures["biases"]]
    bias_table = (
        table(("encoders and mount", "°", "sigma °"), biases, (1, 2)) if biases else "<p>No bias is fitted.</p>"
    )
    fits = f"{text(found['fit_count'])} fits, the last"
    return (
        f'<h2>Correction and biases</h2>{along}{across}<div class="pair">'
        f"<div>{table((fits, 'value', 'sigma'), rows, (1, 2))}</div>"
        f"<div>{bias_table}</div></div>"
    )


def line_section(figures: Figures) -> str:
    """Latency, ticks, limits, refusals, the line."""
    latency, ticks, curve = figures["latency"], figures["ticks"], figures["curves"].get("latency")
    drawn = ""
    if curve and curve["t_s"]:
        drawn = chart(
            "Latency of the exchanges",
            "ms, slowest of each slot",
            [ChartLine("latency", curve["t_s"], curve["ms"], "a")],
            zero_s_of_day=_zero_s(figures),
            span_s=_span(figures["curves"]["path"]["t_s"]),
            height=130.0,
            from_zero=True,
        )
    rows = [
        ("exchanges answered", text(latency["exchange_count"])),
        ("not answered", text(latency["unanswered_count"])),
        ("latency, ms: half of them", text(latency.get("p50_ms"))),
        ("99 %", text(latency.get("p99_ms"))),
        ("slowest", text(latency.get("max_ms"))),
        ("ticks", text(ticks["count"])),
        ("ticks left out", text(ticks["left_out_count"])),
        ("longest time between two, s", text(ticks["longest_gap_s"])),
    ]
    limited = [(escape(name.replace("_", " ")), text(count)) for name, count in figures["limited"].items()]
    refused = [(time_of_day(one["utc"]), escape(one["command"]), escape(one["why"])) for one in figures["refused"]]
    told = [(time_of_day(one["utc"]), escape(one["what"]), escape(one["text"])) for one in figures["line"]]
    return (
        f'<h2>Line and commands</h2>{drawn}<div class="pair"><div>{table(("", ""), rows, (1,))}</div><div>'
        f"{table(('register writes', ''), limited, (1,))}"
        f"<h3>Commands that the ACU refused</h3>{or_none(('UTC', 'command', 'why'), refused)}"
        f"<h3>Line, clock, fit process</h3>{or_none(('UTC', 'what', ''), told)}</div></div>"
    )
