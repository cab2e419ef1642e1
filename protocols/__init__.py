# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts bytes to typed messages and back. Opens no port, does not read a clock, never sleeps."""
