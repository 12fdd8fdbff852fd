"""The ACU on the wire, ICD sections 2 to 4, both sides.  Pure."""
