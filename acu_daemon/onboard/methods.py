"""The four ways to a profile over one pass, side by side."""

import numpy as np

from acu_daemon.model import Station
from acu_daemon.onboard.free import free_profile
from acu_daemon.onboard.pointed import pointed_profile
from acu_daemon.onboard.profile import Method, Objective, Profile, Task, peak_rate_deg_s
from acu_daemon.onboard.targets import peak_rates_deg_s, search_grid, three_stations


def make_profile(task: Task, station: Station, method: Method, objective: Objective = "peak") -> Profile | None:
    """A profile by one method; None only from the free path, where none keeps to margin, ranges and rates."""
    if method == "free":
        return free_profile(task, objective)
    if method == "single":
        return pointed_profile(task, task.station_itrs_m, method)
    three = three_stations(task.view, station, task.margin_deg)
    of_three = pointed_profile(task, three[int(np.argmin(peak_rates_deg_s(task.view, three)))], method)
    if method == "three":
        return of_three
    points = search_grid(task.view, station, task.margin_deg)
    found = pointed_profile(task, points[int(np.argmin(peak_rates_deg_s(task.view, points)))], method)
    # the three are searched too: where the fit turned the order round, theirs is what the search finds
    return min(found, of_three, key=lambda one: peak_rate_deg_s(one.azimuth, task.view))
