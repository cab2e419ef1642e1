# SPDX-License-Identifier: GPL-3.0-or-later
"""One package per flight controller firmware, and the table that lists them."""
