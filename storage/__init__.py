# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions on disk. Knows SQLite and nothing of MAVLink or MSP."""
