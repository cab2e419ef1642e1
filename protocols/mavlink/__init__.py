# SPDX-License-Identifier: GPL-3.0-or-later
"""MAVLink 1 and 2: frames and the messages that the bridge itself speaks."""
