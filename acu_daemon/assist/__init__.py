"""Assisted tracking proper: inversion, estimators, gate of readings, prediction buffer.  Pure."""
