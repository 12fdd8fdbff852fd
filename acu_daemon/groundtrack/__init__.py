"""Keeping the ground track of a phased satellite: orbit, navigator and controller of Galski and Orlando 2011; ours."""
