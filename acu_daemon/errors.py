"""The error tree.  Expected outcomes (a garbled frame, a NAK, a fit that did not converge) are values, not errors.

AcuDaemonError
├── UsageError              wrong use or configuration; exit status 2
│   ├── ConfigError         a TOML file: says file, key, value, what was expected
│   ├── ElementsError       an element set: says file, line, reason
│   ├── EarthOrientationError  a file of Earth orientation or leap seconds: says file, line, reason
│   └── AttitudeError       a satellite's attitude, from a file or a plan: says where and why
├── CampaignError           runs of a campaign failed; names them
├── ProfileError            no tracking profile of a satellite's antenna keeps to margin, ranges and limits
├── OrbitError              a propagator has no answer (decayed, outside its span)
├── LinkError               the connection to the ACU failed
│   └── LinkRefusedError    another client holds the ACU, or nobody listens
├── NoDaemonError           no daemon runs where one was asked
└── NoAcuError              no good poll within the start's time limit; exit status 3
"""


class AcuDaemonError(Exception):
    """Base of everything this package raises on purpose."""


def failure_text(error: Exception) -> str:
    """Why something failed: what was raised on purpose says it itself, of anything else the kind is told too."""
    return str(error) if isinstance(error, AcuDaemonError) else f"{type(error).__name__}: {error}"


class UsageError(AcuDaemonError):
    """Wrong use: the message says what to do instead."""


class ConfigError(UsageError):
    """A configuration file cannot be used; the message names file, key, value and what was expected."""


class ElementsError(UsageError):
    """An element set cannot be used; the message names file, line and reason."""


class CampaignError(AcuDaemonError):
    """Runs of a campaign failed; the message names them, and why."""


class AttitudeError(UsageError):
    """A satellite's attitude cannot be used; the message says where and why."""


class EarthOrientationError(UsageError):
    """A file of Earth orientation or of leap seconds cannot be used; the message names file, line and reason."""


class ProfileError(AcuDaemonError):
    """No tracking profile of a satellite's antenna keeps to margin, ranges and limits; the message says what would."""


class OrbitError(AcuDaemonError):
    """A propagator has no answer for the times asked."""


class LinkError(AcuDaemonError):
    """The connection to the ACU failed."""


class LinkRefusedError(LinkError):
    """The ACU's side closed at once or refused: another client holds it, or nobody listens."""


class NoDaemonError(AcuDaemonError):
    """No daemon runs where one was asked; the message says how to choose or to start one."""


class NoAcuError(AcuDaemonError):
    """No good poll within the time limit of the start."""
