"""Orbit prediction on board a satellite, in the stand-alone room beside the ground station's."""
