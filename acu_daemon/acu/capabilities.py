"""What an ACU can do: all that the decision of a tick knows of which ACU it has."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Capabilities:
    """What an ACU can do, in the words of the field.  The defaults are those of one that can do everything.

    Whether it is simulated is no matter of its kind: its identity says so (`AcuIdentity.is_simulated`).
    """

    has_autotrack: bool = True  # it follows the signal by itself: only then do its angles tell of the satellite
    has_backup: bool = True  # after a loss it goes by what was selected: rates, position, or the commanded angles
    has_sector_bit: bool = True  # one bit for the half of a range wider than a turn
    has_turn_choice: bool = True  # a parameter decides on which of two turns a bearing is followed
    has_register_watchdog: bool = True  # it stops the antenna when no angles are commanded for a while
    has_stow: bool = True  # it has a stow position of its own, and goes there when it is told
    has_read_back: bool = True  # the commanded angles can be read
    has_combined_write: bool = True  # angles are commanded and the status asked in one exchange
    is_azimuth_continuous: bool = False  # it counts the turns of the cable; else it shows a bearing
    angle_step_deg: float = 360.0 / 2**16  # of angles that are commanded, and of those that are read at best
    dead_band_deg: float = 0.0  # nearer than this to the last angle no other is commanded, so that relays live
    reply_deadline_s: float = 0.090  # from the start of the write; a reply that is not complete then has not come
    silence_s: float = 0.5  # without a valid reply for so long the link is lost
    watchdog_step_s: float = 0.02  # of the register watchdog's time
