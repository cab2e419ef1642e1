# SPDX-License-Identifier: GPL-3.0-or-later
"""The states of the line to a flight controller. The table between them is in bridge/fc/session.py."""
