"""Whether the system's clock can be right: one that was never set since the boot is not tracked by, but waited for."""

from acu_daemon import RELEASED_UTC
from acu_daemon.edge.elements_file import LoadedElements
from acu_daemon.orbit.propagator import is_ephemeris, spans_tai_s
from acu_daemon.orbit.timescales import tai_from_utc, utc_text
from acu_daemon.units import DAY_S

AHEAD_S = DAY_S  # elements are issued for so long ahead at most


def before_release(now_tai_s: float) -> str:
    """Say that the clock shows a time before this program was made; empty: it does not."""
    if now_tai_s >= tai_from_utc(RELEASED_UTC):
        return ""
    return (
        f"the system clock says {utc_text(now_tai_s, 0)}, before this program was made ({RELEASED_UTC}): "
        "it was not set since the boot; start chrony or ntpd, or set it"
    )


def before_elements(elements: LoadedElements, now_tai_s: float, is_synchronised: bool | None) -> str:
    """Say that nothing has synchronised the clock and that all elements are ahead of it; empty: not both."""
    propagator = elements.propagator
    first_tai_s = spans_tai_s(propagator)[0][0] if is_ephemeris(propagator) else elements.epoch_tai_s
    if is_synchronised is not False or first_tai_s - now_tai_s <= AHEAD_S:
        return ""
    return (
        f"the system clock says {utc_text(now_tai_s, 0)}, nothing has synchronised it, and all elements of "
        f"{elements.label} are ahead of it, the first of {utc_text(first_tai_s, 0)}: start chrony or ntpd, or set it"
    )
