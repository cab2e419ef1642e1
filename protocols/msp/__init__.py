"""MultiWii Serial Protocol, version 1."""
