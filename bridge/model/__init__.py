# SPDX-License-Identifier: GPL-3.0-or-later
"""Plain data that the rest of the bridge shares: the vehicle, events, refusals."""
