# SPDX-License-Identifier: GPL-3.0-or-later
"""The bridge's decisions. Sans-IO: time and bytes are passed in, effects are returned."""
