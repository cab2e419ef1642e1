# SPDX-License-Identifier: GPL-3.0-or-later
"""The effect of each request that can reach a flight controller. A request that is not listed here is refused."""
