# SPDX-License-Identifier: GPL-3.0-or-later
"""Bytes to typed messages and back. Nothing here opens a port, reads a clock or sleeps."""
