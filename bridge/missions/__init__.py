# SPDX-License-Identifier: GPL-3.0-or-later
"""Missions, independent of the flight controller: checking, storing, reading back."""
