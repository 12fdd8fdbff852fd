"""The ACU on the wire, both sides (docs/protocol.md).  Pure."""
