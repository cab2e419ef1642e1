# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions on disk. Uses SQLite and knows nothing about MAVLink or MSP."""
