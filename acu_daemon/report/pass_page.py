"""The report of a pass as one HTML page without outside parts.  Pure: it shows what stands in its figures."""

from html import escape

from acu_daemon.report.page_parts import Figures, day_time, or_none, page, table, text, time_of_day
from acu_daemon.report.pass_sections import (
    HALF_BEAM,
    correction_section,
    course_section,
    line_section,
    residuals_section,
)
from acu_daemon.report.pass_station import station_section
from acu_daemon.report.svg_chart import sky_chart

LOW_S = 30.0  # before the set: nobody's fault so near to the horizon


def pass_page(figures: Figures) -> str:
    """The report of a pass (report.pass_figures)."""
    about, plan = figures["pass"], figures["plan"]
    when = plan["rise_utc"] if plan else figures["outcome"]["begun_utc"]
    body = "".join(
        (
            _head(figures, when),
            _tiles(figures),
            _sky_and_plan(figures),
            station_section(figures),
            course_section(figures),
            _losses(figures),
            residuals_section(figures),
            correction_section(figures),
            line_section(figures),
            _rest(figures),
            f'<p class="dim">acu-daemon {escape(figures["version"])}, made from the recording of the pass; every '
            "figure is in the JSON beside this page.</p>",
        )
    )
    return page(f"{about['satellite']} over {about['station']}, {day_time(when)}", body)


def verdict_of(figures: Figures) -> tuple[str, str]:
    """How the pass came out, in words, and how good that is."""
    outcome = figures["outcome"]
    if outcome["first_acquired_utc"] is None:
        return "never acquired", "bad"
    losses = figures["losses"]
    if (lost_s := outcome.get("lost_at_end_s") or 0.0) > LOW_S:  # a report of before has none
        return f"lost for the last {lost_s} s", "bad"
    if not losses:
        return "tracked without a loss", "good"
    farthest = outcome["largest_off_path_in_losses_beamwidths"]
    is_near = farthest is not None and farthest < HALF_BEAM
    said = f"{len(losses)} {'loss' if len(losses) == 1 else 'losses'}"
    return (f"tracked through {said}", "good") if is_near else (f"tracked with {said}", "watch")


def _head(figures: Figures, when: str | None) -> str:
    about = figures["pass"]
    number = "" if about["norad_id"] is None else f' <span class="dim">({about["norad_id"]})</span>'
    said, level = verdict_of(figures)
    marks = [name for name in ("rehearsal", "shadow") if about[f"is_{name}"]]
    mark = f' <span class="mark-line">{" ".join(marks).upper()}</span>' if marks else ""
    whole = "" if about["is_recording_whole"] else " The recording was cut: the daemon was killed, or began anew."
    return (
        f'<h1>{escape(about["satellite"])}{number}{mark}</h1><p class="dim">over {escape(about["station"])}, '
        f"{text(about['latitude_deg'])}° {text(about['longitude_deg'])}° {text(about['height_m'])} m · rise "
        f"{day_time(when)} · {escape(about['elements'])} of {day_time(about['elements_epoch_utc'])}, "
        f"{text(about['elements_age_days'])} days old</p>"
        f'<p><span class="verdict {level}">{escape(said)}</span>{escape(whole)}</p>'
    )


def _tiles(figures: Figures) -> str:
    outcome, correction, latency = figures["outcome"], figures["correction"] or {}, figures["latency"]
    after = figures["residuals"]["after"] or {}
    tiles = (
        (outcome["acquired_share"], "of the readings acquired"),
        (outcome["loss_count"], f"losses, {text(outcome['lost_s'])} s together"),
        (outcome["longest_relock_s"], "s, the longest relock"),
        (outcome["largest_off_path_in_losses_beamwidths"], "beamwidths off the path in losses, at most"),
        (correction.get("along_s"), f"s along the track, ± {text(correction.get('along_sigma_s'))}"),
        (correction.get("across_deg"), f"° across, ± {text(correction.get('across_sigma_deg'))}"),
        (after.get("rms_deg"), "° of residuals after the fit, rms"),
        (latency.get("p99_ms"), "ms of an exchange, 99 %"),
    )
    return (
        '<div class="tiles">'
        + "".join(f'<div class="tile"><b>{text(value)}</b><span>{what}</span></div>' for value, what in tiles)
        + "</div>"
    )


def _sky_and_plan(figures: Figures) -> str:
    plan, outcome, path = figures["plan"], figures["outcome"], figures["curves"].get("path")
    sky = ""
    if path:
        from_s, to_s = figures["curves"]["rise_t_s"], figures["curves"]["set_t_s"]
        shown = [
            k
            for k, t_s in enumerate(path["t_s"])
            if (from_s is None or from_s <= t_s) and (to_s is None or t_s <= to_s)
        ]
        values = ([path[name][k] for k in shown] for name in ("az_deg", "el_deg", "is_acquired"))
        sky = sky_chart("Path over the station, north up", *values)
        sky += (
            '<p class="dim"><span class="key good"></span>acquired<span class="key bad"></span>not acquired; '
            "open circle: where it began</p>"
        )
    if plan is None:
        return f"<h2>Path</h2>{sky}"
    rows = [
        ("rise, first acquired", time_of_day(plan["rise_utc"]), time_of_day(outcome["first_acquired_utc"])),
        ("highest", time_of_day(plan["culmination_utc"]), time_of_day(plan["came_highest_utc"])),
        ("highest, elevation °", text(plan["culmination_el_deg"]), text(plan["came_highest_el_deg"])),
        ("set, last acquired", time_of_day(plan["set_utc"]), time_of_day(outcome["last_acquired_utc"])),
        ("begins at azimuth °", text(plan["start_az_deg"]), ""),
        ("past the zenith, s", text(plan["zenith_lost_s"]), text(plan["came_zenith_s"])),
        (
            "past the zenith, largest error °",
            text(plan["zenith_largest_error_deg"]),
            text(plan["came_zenith_largest_off_deg"]),
        ),
        ("out of half the beam, s", "", text(plan["came_out_of_half_beam_s"])),
        ("behind the skyline, s", text(plan["hidden_s"]), ""),
        ("changes of the cable's turn", text(plan["unwinding_count"]), ""),
    ]
    beyond = "".join(f"<p>{escape(one)}</p>" for one in plan["beyond_reach"])
    schedule = figures["schedule"]
    granted = "" if schedule is None else _facts("The schedule", schedule)
    return (
        f'<h2>Path, and what the plan said</h2><div class="two"><div>{sky}</div><div>'
        f"{table(('', 'planned', 'came'), rows, (1, 2))}{beyond}{granted}</div></div>"
    )


def _facts(title: str, facts: Figures) -> str:
    rows = [(escape(name.replace("_", " ")), text(value)) for name, value in facts.items()]
    return f"<h3>{escape(title)}</h3>{table(('', ''), rows)}"


def _losses(figures: Figures) -> str:
    rows = [
        (
            time_of_day(one["start_utc"]),
            text(one["length_s"]),
            ", ".join(f"{escape(each['state'])} {text(each['share'])}" for each in one["followed"]),
            text(one["relock_s"]),
            text(one["largest_off_path_beamwidths"]),
        )
        for one in figures["losses"]
    ]
    if not rows:
        return "<h2>Losses</h2><p>None.</p>"
    heads = ("start UTC", "length s", "followed, by share of it", "relock s", "off the path, beamwidths")
    return f"<h2>Losses</h2>{table(heads, rows, (1, 3, 4))}"


def _rest(figures: Figures) -> str:
    hooks = [
        (
            escape(one.get("hook", "")),
            text(one.get("status")),
            text(one.get("lasted_s")),
            text(one.get("problem") or one.get("said")),
        )
        for one in figures["hooks"]
    ]
    running = figures["station"]["running_hooks"] if figures["station"] else []
    hooks += [(escape(one), text(None), text(None), "still running when the report was made") for one in running]
    events = [
        (time_of_day(one["utc"]), escape(one["name"]), escape(one["said"]), text(one["count"]))
        for one in figures["events"]
    ]
    return (
        f"<h2>Hooks</h2>{or_none(('hook', 'exit status', 'for s', 'said'), hooks)}"
        f"<h2>Warnings of the decision</h2>{or_none(('UTC', 'event', '', 'times'), events)}"
    )
