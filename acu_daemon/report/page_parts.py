"""Pieces of the HTML pages: a whole page, a table, a value.  Pure."""

from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

from acu_daemon.report.page_style import STYLE

UNKNOWN = "–"
Figures = dict[str, Any]


def page(title: str, body: str) -> str:
    """A whole HTML document."""
    return (
        f'<!doctype html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" '
        f'content="width=device-width, initial-scale=1"><title>{escape(title)}</title><style>{STYLE}</style></head>'
        f"<body><main>{body}</main></body></html>\n"
    )


def text(value: Any) -> str:
    """A value as it stands in the JSON; what is not known is a dash."""
    return UNKNOWN if value is None else escape(str(value))


def table(heads: Sequence[str], rows: Iterable[Sequence[str]], numbers: Sequence[int] = ()) -> str:
    """An HTML table; cells are HTML already.  numbers: columns that are aligned as such."""
    kind = [' class="n"' if k in numbers else "" for k in range(len(heads))]
    head = "".join(f"<th{kind[k]}>{one}</th>" for k, one in enumerate(heads))
    lines = "".join("<tr>" + "".join(f"<td{kind[k]}>{one}</td>" for k, one in enumerate(row)) + "</tr>" for row in rows)
    head = f"<thead><tr>{head}</tr></thead>" if any(heads) else ""
    return f'<div class="wide"><table>{head}<tbody>{lines}</tbody></table></div>'


def day_time(utc: str | None) -> str:
    """Date and time for people."""
    return UNKNOWN if utc is None else f"{utc[:10]} {utc[11:19]}Z"


def time_of_day(utc: str | None) -> str:
    """Without the date."""
    return UNKNOWN if utc is None else escape(utc[11:].removesuffix("Z"))


def or_none(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """A table, or that there is nothing to put in it."""
    return table(heads, rows) if rows else "<p>None.</p>"
