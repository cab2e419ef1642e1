"""Bytes to typed messages and back. Nothing here opens a port, reads a clock or sleeps."""
