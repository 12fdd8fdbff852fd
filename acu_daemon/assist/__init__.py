"""Assisted tracking: estimators of the orbit, screening of readings, and the estimation session of a pass.  Pure."""
