"""The page of all passes of a station: each figure of a row, their order, what drifts from the first to the last."""

import re
from copy import deepcopy
from typing import Any

import pytest
from test_every_figure_of_a_report import figures

from acu_daemon.report.passes_index import DRIFTING, index_figures, index_page

ROW_KEYS = (
    *("acquired_share", "loss_count", "lost_s", "longest_relock_s", "off_path_beamwidths", "along_s"),
    *("across_deg", "refused_count"),
)


def report(**parts: Any) -> dict[str, Any]:
    made = deepcopy(figures())
    for name, part in parts.items():
        made[name] = made[name] | part if isinstance(part, dict) else part
    return made


def test_a_row_has_each_figure_from_its_place() -> None:
    residuals = {"reading_count": 9, "before": {"rms_deg": 0.9}, "after": {"rms_deg": 0.04}}
    made = report(residuals=residuals, **{"pass": {"is_rehearsal": False}})
    about, plan = made["pass"], made["plan"]
    [row] = index_figures([("name", made)])["passes"]
    assert row == {
        "name": "name",
        "station": about["station"],
        "satellite": about["satellite"],
        "is_rehearsal": False,
        "rise_utc": plan["rise_utc"],
        "highest_el_deg": plan["culmination_el_deg"],
        "verdict": "tracked with 1 loss",
        "level": "watch",
        "acquired_share": 0.5,
        "loss_count": 1,
        "lost_s": 1.0,
        "longest_relock_s": 0.5,
        "off_path_beamwidths": 0.66,
        "along_s": -1.234,
        "across_deg": 0.0567,
        "bias_az_deg": 0.021,
        "bias_el_deg": 0.023,
        "residual_rms_deg": 0.04,
        "latency_p99_ms": 99.01,
        "refused_count": 1,
    }


def test_what_a_pass_does_not_have_is_not_known() -> None:
    made = report(plan=None, correction=None, biases=[], latency=None, refused=[])
    made["latency"] = {}
    [row] = index_figures([("name", made)])["passes"]
    assert row["rise_utc"] == made["outcome"]["begun_utc"]
    nothing = ("highest_el_deg", "along_s", "across_deg", "bias_az_deg", "bias_el_deg", "residual_rms_deg")
    assert [row[key] for key in (*nothing, "latency_p99_ms")] == [None] * 7
    assert row["refused_count"] == 0


def utc(hour: int | None) -> str | None:
    return None if hour is None else f"2026-08-18T{hour:02}:44:11.4Z"


def index_of(*hours: int | None, stations: tuple[str, ...] = ("Cuiaba",)) -> dict[str, Any]:
    made = []
    for k, hour in enumerate(hours):
        about = {"station": stations[k % len(stations)], "is_rehearsal": k == 1}
        one = report(plan={"rise_utc": utc(hour)}, **{"pass": about, "outcome": {"begun_utc": None}})
        one["correction"]["along_s"] = hour
        made.append((f"r{k}", one))
    return index_figures(made)


def test_rows_are_in_the_order_of_the_rises_those_of_an_unknown_one_first() -> None:
    found = index_of(12, 3, None, 7)
    assert [row["name"] for row in found["passes"]] == ["r2", "r1", "r3", "r0"]
    assert found["format"] == 1


def test_stations_are_told_once_each_in_order() -> None:
    found = index_of(1, 2, 3, stations=("Natal", "Cuiaba"))
    assert found["stations"] == ["Cuiaba", "Natal"]
    page = index_page(found)
    assert "<h1>Passes of Cuiaba, Natal</h1>" in page
    assert "<title>Passes of Cuiaba, Natal</title>" in page
    assert ">3 passes; " in page


def rows_of(page: str) -> list[list[str]]:
    rows = (re.findall(r"<td[^>]*>(.*?)</td>", line) for line in re.findall(r"<tr>(.*?)</tr>", page))
    return [row for row in rows if row]


def test_the_page_shows_the_newest_first_with_each_figure_under_its_head() -> None:
    found = index_of(12, 3, 7)
    rows = rows_of(index_page(found))[len(DRIFTING) :]
    assert [re.sub("<.*?>", "", row[0]) for row in rows] == [f"2026-08-18 {hour:02}:44" for hour in (12, 7, 3)]
    assert [re.findall('href="(.*?)"', row[0]) for row in rows] == [["r0.html"], ["r2.html"], ["r1.html"]]
    assert [row[1].endswith(" (rehearsal)") for row in rows] == [False, False, True]
    first = found["passes"][-1]
    assert rows[0][2] == str(first["highest_el_deg"])
    assert rows[0][3] == '<span class="verdict watch">tracked with 1 loss</span>'
    assert rows[0][4:] == [str(first[key]) for key in ROW_KEYS]
    heads = re.findall(r"<th(?: [^>]*)?>(.*?)</th>", index_page(found))[4:]
    assert heads == [
        *("UTC", "satellite", "highest °", "", "acquired", "losses", "lost s", "relock s", "off path", "along s"),
        *("across °", "refused"),
    ]


@pytest.mark.parametrize(
    ("hours", "ends"), [((3, 7, 12), ["3", "12"]), ((12, 7), ["7", "12"]), ((5,), ["5", "5"]), ((0, 7), ["0", "7"])]
)
def test_what_drifts_is_told_from_the_first_to_the_last_that_are_known(hours: tuple[int, ...], ends: list[str]) -> None:
    rows = rows_of(index_page(index_of(*hours)))
    [along] = [row for row in rows if row[0] == "correction along the track, s"]
    assert along[2:] == ends


def test_one_that_is_not_known_is_passed_over_and_where_none_is_there_are_dashes() -> None:
    found = index_of(3, 7, 12)
    for row in (found["passes"][0], found["passes"][2]):
        row["along_s"] = None
    for row in found["passes"]:
        row["across_deg"] = None
    rows = {row[0]: row[2:] for row in rows_of(index_page(found))[: len(DRIFTING)]}
    assert rows["correction along the track, s"] == ["7", "7"]
    assert rows["correction across, °"] == ["–", "–"]
    assert list(rows) == [what for _, what in DRIFTING]


def test_a_page_without_passes_is_one() -> None:
    page = index_page({"format": 1, "stations": [], "passes": []})
    assert ">0 passes; " in page


def test_a_pass_without_a_rise_and_words_of_others_are_shown_as_they_are() -> None:
    found = index_of(None)
    found["passes"][0] |= {"satellite": "<b>", "verdict": "<i>", "name": 'a"b'}
    page = index_page(found)
    assert "&lt;b&gt;" in page
    assert "&lt;i&gt;" in page
    assert 'href="a&quot;b.html"></a>' in page


def test_names_are_words_and_not_marks_of_the_page() -> None:
    made = report(**{"pass": {"satellite": "<b>A&B", "station": "<i>S"}})
    page = index_page(index_figures([('x"y', made)]))
    assert "&lt;b&gt;A&amp;B" in page
    assert "<h1>Passes of &lt;i&gt;S</h1>" in page
    assert 'href="x&quot;y.html"' in page
    assert "<b>A" not in page
    assert "<i>" not in page


def test_a_pass_that_rises_just_after_midnight_is_after_one_of_the_day_before() -> None:
    times = ("2026-08-19T00:00:01Z", "2026-08-18T23:59:59Z", "2025-12-31T12:00:00Z")
    made = [(name, report(plan={"rise_utc": utc})) for name, utc in zip("abc", times, strict=True)]
    assert [row["name"] for row in index_figures(made)["passes"]] == ["c", "b", "a"]
    without = report(plan=None, outcome={"begun_utc": "2026-08-19T00:00:00Z"})
    assert [row["name"] for row in index_figures([*made, ("d", without)])["passes"]] == ["c", "b", "d", "a"]
