"""When the newest STOP went out, and when it was confirmed."""

from acu_daemon.acu.replies import Done
from acu_daemon.daemon.stop_times import StopTimes


def test_a_stop_that_is_repeated_keeps_its_first_time_until_it_is_confirmed() -> None:
    times = StopTimes().after(10.0, None, None)
    assert times == StopTimes(10.0, None)
    times = times.after(10.3, 10.32, Done())
    assert times == StopTimes(10.0, 10.32)
    assert times.after(20.0, 20.02, Done()) == StopTimes(20.0, 20.02)
    assert times.after(20.0, None, None) == StopTimes(20.0, None)
