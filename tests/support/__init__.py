# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by the tests: boards, ground stations, worlds in simulated time, programs as a user starts them."""
