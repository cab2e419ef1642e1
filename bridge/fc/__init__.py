# SPDX-License-Identifier: GPL-3.0-or-later
"""Talking to a flight controller: finding it, identifying it, keeping the line."""
