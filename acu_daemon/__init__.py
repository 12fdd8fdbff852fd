"""Assisted tracking: a real-time daemon between a ground station and its antenna control unit."""

__version__ = "0.1.0"
