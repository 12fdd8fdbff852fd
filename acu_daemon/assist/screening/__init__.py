"""Screening of readings by the orbit: side lobe, wrong target, accelerating axis.  Pure."""
