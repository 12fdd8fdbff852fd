"""[web] of station.toml: the operator's page, where it listens and who may order."""

from pydantic import Field, field_validator

from acu_daemon.config.section import Name, Section, address_of


def check_listen(text: str) -> tuple[str, int]:
    """Address and port of `ADDRESS:PORT`.  ValueError: says what was expected."""
    return address_of(text, "127.0.0.1:8642")


class WebSection(Section):
    listen: Name | None = Field(
        default=None,
        json_schema_extra={"range": "ADDRESS:PORT"},
        description=(
            "Where the operator's page is served; an address that others reach, such as 0.0.0.0, only in a network "
            "that is trusted.  Decides whether there is a page, and who sees it."
        ),
    )
    token_file: Name | None = Field(
        default=None,
        json_schema_extra={"range": "a path"},
        description=(
            "A file beside station.toml, or elsewhere, of mode 0600, with a token of 16 characters or more.  Decides "
            "who may order by the page; without it the page shows, and stops."
        ),
    )
    names: list[Name] = Field(
        default=[],
        json_schema_extra={"range": "host names"},
        description=(
            "Names under which browsers reach the page, such as of a proxy in front of it; addresses and localhost "
            "need none.  Decides which requests are answered."
        ),
    )

    @field_validator("listen")
    @classmethod
    def _is_address(cls, value: str | None) -> str | None:
        if value is not None:
            check_listen(value)
        return value
