"""Rotators of amateur radio behind Hamlib's rotctld, on TCP: position only.  Pure."""
