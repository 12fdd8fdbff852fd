"""What a station remembers of its antenna from pass to pass, of whatever satellites.  Pure."""
