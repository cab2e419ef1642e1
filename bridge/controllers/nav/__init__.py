# SPDX-License-Identifier: GPL-3.0-or-later
"""Rules and transfers shared by INAV and MultiWii NAV, which both use MSP_SET_WP."""
