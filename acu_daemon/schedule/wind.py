"""When the wind stows the antenna, and when it may move again.  Pure.

       mean or gust above its limit                    both below resume_share of their limits for resume_after_s
CALM ------------------------------> STRONG  STRONG ------------------------------------------------------------> CALM
and from any of them STALE, once nothing was heard for max_age_s; a wind that was strong counts as strong until it is
heard to be calm, one that was calm as `when_stale` says.  Whoever looks may let a stale wind go.
"""

from dataclasses import dataclass, replace
from enum import StrEnum
from math import inf, isfinite
from typing import Literal

from acu_daemon.orbit.timescales import utc_text

MOST_M_S = 150.0  # more is no wind


class Wind(StrEnum):
    """What is known of the wind."""

    UNWATCHED = "unwatched"
    CALM = "calm"
    STRONG = "strong"
    STALE = "stale"


@dataclass(frozen=True, slots=True)
class WindRules:
    """Limits, m/s: of the ten-minute mean and of the three-second gust; times in seconds."""

    mean_limit_m_s: float = 11.1
    gust_limit_m_s: float = 16.9
    resume_share: float = 0.8
    resume_after_s: float = 600.0
    max_age_s: float = 60.0
    when_stale: Literal["go_on", "stow"] = "go_on"


@dataclass(frozen=True, slots=True)
class WindSample:
    """What a sensor said, of a time."""

    mean_m_s: float
    gust_m_s: float
    tai_s: float

    @property
    def is_possible(self) -> bool:
        """Whether both are speeds that a wind has."""
        return all(isfinite(one) and 0.0 <= one <= MOST_M_S for one in (self.mean_m_s, self.gust_m_s))


@dataclass(frozen=True, slots=True)
class WindWatch:
    """The memory of the watch.  wants_stow: the antenna is to be stowed now; calm_since: since when it is low."""

    wind: Wind = Wind.UNWATCHED
    wants_stow: bool = False
    calm_since_tai_s: float = inf
    newest: WindSample | None = None
    is_let_go: bool = False  # a person has ended the stow of a stale wind; holds until the wind is heard again

    @property
    def words(self) -> str:
        """For people; empty: the wind is not watched."""
        if self.wind is Wind.UNWATCHED:
            return ""
        seen = self.newest
        said = "" if seen is None else f", mean {seen.mean_m_s:.1f} m/s, gusts {seen.gust_m_s:.1f} m/s"
        calm = f", calm since {utc_text(self.calm_since_tai_s, 0)[11:19]}" if isfinite(self.calm_since_tai_s) else ""
        return f"wind {self.wind}{said}{', stow' if self.wants_stow else ''}{calm}"


def watch(before: WindWatch, sample: WindSample | None, rules: WindRules, now_tai_s: float) -> WindWatch:
    """Take what was heard since the last look; sample None: nothing new."""
    if sample is not None and sample.is_possible:
        is_newest = before.newest is None or sample.tai_s >= before.newest.tai_s
        before = replace(before, newest=sample) if is_newest else before
    newest = before.newest
    if newest is None or now_tai_s - newest.tai_s > rules.max_age_s:
        wants_stow = not before.is_let_go and (before.wants_stow or rules.when_stale == "stow")
        return replace(before, wind=Wind.STALE, wants_stow=wants_stow, calm_since_tai_s=inf)
    before = replace(before, is_let_go=False)
    if newest.mean_m_s > rules.mean_limit_m_s or newest.gust_m_s > rules.gust_limit_m_s:
        return replace(before, wind=Wind.STRONG, wants_stow=True, calm_since_tai_s=inf)
    if not before.wants_stow:
        return replace(before, wind=Wind.CALM, calm_since_tai_s=inf)
    share = rules.resume_share
    if newest.mean_m_s > share * rules.mean_limit_m_s or newest.gust_m_s > share * rules.gust_limit_m_s:
        return replace(before, wind=Wind.STRONG, calm_since_tai_s=inf)
    since_tai_s = min(before.calm_since_tai_s, newest.tai_s)
    if now_tai_s - since_tai_s < rules.resume_after_s:
        return replace(before, wind=Wind.STRONG, calm_since_tai_s=since_tai_s)
    return replace(before, wind=Wind.CALM, wants_stow=False, calm_since_tai_s=inf)
