"""Assisted tracking: a real-time daemon between a ground station and its antenna control unit."""

import time

__version__ = "0.1.0"

PROCESS_START_S = time.monotonic()  # as early as this program can know it: `--at` counts from here
