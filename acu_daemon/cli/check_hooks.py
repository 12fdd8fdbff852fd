"""What `acu-daemon check` says of the station's hooks: as whom they run."""

import os

from acu_daemon.cli.check_finding import GO, NO_GO, WARN, Finding
from acu_daemon.config.station_day_tables import HooksSection
from acu_daemon.edge.hook_rights import hook_user, is_there_a_launcher, said_of_rights, why_not_switch
from acu_daemon.errors import UsageError

HOOKS = "hooks"


def hooks_finding(section: HooksSection) -> Finding | None:
    """None: there are no hooks.  That this process may not switch is a warning: the daemon may be another user's."""
    if not any(section.commands.values()):
        return None
    try:
        user = None if section.user is None else hook_user(section.user)
    except UsageError as error:
        return Finding(NO_GO, HOOKS, str(error))
    if not is_there_a_launcher():
        return Finding(WARN, HOOKS, "they are started by nice and setpriv, which are not here: install util-linux")
    if user is not None and (why := why_not_switch(user)):
        return Finding(WARN, HOOKS, why)
    if user is None and os.geteuid() == 0:
        return Finding(WARN, HOOKS, "run as root; name a [hooks] user that may do less")
    return Finding(GO, HOOKS, said_of_rights(user))
