"""[elements] of station.toml: where the elements of all satellites come from, and how often anybody is asked."""

from typing import Annotated, Literal
from urllib.parse import urlsplit

from pydantic import AfterValidator, BeforeValidator, Field

from acu_daemon.config.section import Name, Section

LEAST_H = 2.0  # CelesTrak makes its files anew no more often


def _listed(value: object) -> object:
    return [value] if isinstance(value, str) else value


def is_url(source: str) -> bool:
    """Whether a source is asked over the network; else it is a directory."""
    return "://" in source


def _checked(sources: list[str]) -> list[str]:
    for one in sources:
        parts = urlsplit(one)
        if is_url(one) and (parts.scheme not in ("http", "https") or not parts.hostname):
            raise ValueError(f"{one!r}: expected https://HOST/..., http://HOST/... or a directory")
        if parts.username or parts.password:
            raise ValueError(
                "a name and a password do not belong into a URL; put them into a file and name it by login"
            )
        if not one.strip():
            raise ValueError("expected URLs and directories, not an empty text")
    if len(set(sources)) < len(sources):
        raise ValueError("expected each source once")
    return sources


Sources = Annotated[list[str], BeforeValidator(_listed), AfterValidator(_checked)]


class ElementsSourcesSection(Section):
    source: Sources = Field(
        default=[],
        json_schema_extra={"range": "URLs (https, http) and directories"},
        description=(
            "A directory that others fill, or a URL of a whole group (CelesTrak's OMM as JSON or CSV, TLE; "
            "Space-Track's JSON), or a list of such (docs/elements.md).  Decides what besides a satellite's own file "
            "may say where it is."
        ),
    )
    every_h: float = Field(
        default=8.0,
        ge=LEAST_H,
        le=720,
        description=(
            "A URL is asked at most so often, in hours.  Decides how fresh elements are, and whether one is barred."
        ),
    )
    store: Name = Field(
        default="elements",
        json_schema_extra={"range": "a path"},
        description=(
            "The directory, relative to station.toml, in which what was fetched is kept.  Decides who may fetch: "
            "whoever may write there."
        ),
    )
    fetch: Literal["daemon", "command"] = Field(
        default="daemon",
        description=(
            "`daemon`: `run` fetches by itself, in a process of its own; `command`: only `acu-daemon elements fetch` "
            "does, such as by a timer.  Decides who needs the network."
        ),
    )
    login: Name | None = Field(
        default=None,
        json_schema_extra={"range": "a path"},
        description=(
            'A file beside station.toml with the lines identity = "..." and password = "...", readable by its owner '
            "alone.  Decides as whom Space-Track is asked."
        ),
    )
    ca_file: Name | None = Field(
        default=None,
        json_schema_extra={"range": "a path"},
        description=(
            "Certificates (PEM) of whom to trust besides the system's, such as a proxy's.  Decides which servers of "
            "https are believed."
        ),
    )

    @property
    def urls(self) -> list[str]:
        return [one for one in self.source if is_url(one)]

    @property
    def directories(self) -> list[str]:
        return [one for one in self.source if not is_url(one)]
