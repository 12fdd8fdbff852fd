"""Which passes the station's antenna tracks, and why not the others: an exact plan (docs/schedule.md).  Pure."""
