"""From directions on the sky to axis angles: cable wrap, keyhole plan.  Pure."""
