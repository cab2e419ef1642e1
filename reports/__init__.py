# SPDX-License-Identifier: GPL-3.0-or-later
"""Plain data that the bridge reports to programs and people: findings, verdicts, the vehicle's published values."""
