# SPDX-License-Identifier: GPL-3.0-or-later
"""Simulated flight controllers, faithful enough to test against."""
