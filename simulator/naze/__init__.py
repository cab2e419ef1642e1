# SPDX-License-Identifier: GPL-3.0-or-later
"""A Naze32 with Harakiri: the firmware's main loop, protocols and mission lists."""
