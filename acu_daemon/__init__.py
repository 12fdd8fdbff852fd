"""Assisted tracking: a real-time daemon between a ground station and its antenna control unit."""

import os
import time

__version__ = "0.1.0"
RELEASED_UTC = "2026-11-01T00:00:00Z"  # set at packaging: a system clock that is earlier cannot be right

for _threads in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):  # numpy reads them; more cost a refit a tenth of its time
    os.environ.setdefault(_threads, "1")
os.environ.setdefault("PYDANTIC_DISABLE_PLUGINS", "__all__")  # it would search everything installed for them

PROCESS_START_S = time.monotonic()  # as early as this program can know it: `--at` counts from here
