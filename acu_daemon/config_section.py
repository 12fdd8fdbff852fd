"""What every table of a TOML file has in common."""

from pydantic import BaseModel, ConfigDict


class Section(BaseModel):
    """A table of a TOML file: no unknown keys, no infinite numbers, no text where a number belongs."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, strict=True)

    def _must_be_below(self, lower: str, upper: str) -> None:
        low, high = getattr(self, lower), getattr(self, upper)
        if low >= high:
            raise ValueError(f"{lower} = {low:g}: expected less than {upper} = {high:g}")
