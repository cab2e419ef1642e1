# SPDX-License-Identifier: GPL-3.0-or-later
"""What the bridge decides. Sans-IO: time and bytes are passed in, effects are handed out."""
