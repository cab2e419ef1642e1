# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared test support: boards, ground stations, worlds in simulated time, programs as started by a user."""
