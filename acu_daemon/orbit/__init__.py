"""Orbits seen from a station: time scales, frames, elements, propagators, look angles, passes.  Pure."""
