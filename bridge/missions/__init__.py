# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions, whatever the flight controller: checking, storing, reading back."""
