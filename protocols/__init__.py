# SPDX-License-Identifier: GPL-3.0-or-later
"""Converts bytes to typed messages and back. Does not open ports, read clocks or sleep."""
