"""[recording] of station.toml: what is kept of every pass, for how long, and who gets it."""

from pydantic import Field

from acu_daemon.config.section import Name, Section


class RecordingSection(Section):
    passes: bool = Field(
        default=True,
        description=(
            "Keep the whole line and every input of the decision of each pass, in passes/ of the state directory, for "
            "`acu-daemon report` and `replay --wire` (docs/recordings.md).  Decides nothing of the pass."
        ),
    )
    keep_days: float = Field(
        default=90.0,
        ge=1,
        le=36500,
        description="Older recordings and messages are removed when a pass begins.  Decides that; reports stay.",
    )
    keep_reports_days: float = Field(
        default=1000.0,
        ge=1,
        le=36500,
        description="Older reports are removed when a pass is recorded.  Decides that; the index has the newest 2000.",
    )
    keep_mb: float = Field(
        default=1000.0,
        ge=1,
        le=1e7,
        description="More than this of them is not kept, the oldest go first.  Decides the same.",
    )
    report: bool = Field(
        default=True,
        description=(
            "Make a report of each pass beside its recording, and CCSDS messages of its angles and its orbit.  Decides "
            "nothing of the pass."
        ),
    )
    originator: Name = Field(
        default="ACU-DAEMON",
        max_length=40,
        description="Who the messages say they are from.  Decides nothing here.",
    )
    send_to: Name | None = Field(
        default=None,
        json_schema_extra={"range": "a directory"},
        description=(
            "Where a copy of the fitted orbit is put after each pass, beside station.toml unless it begins with `/`, "
            "such as a directory that the next station names in its [elements] directories.  Decides what that one "
            "tracks by."
        ),
    )
