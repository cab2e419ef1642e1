# SPDX-License-Identifier: GPL-3.0-or-later
"""Ground stations: their connections, their rights, and the messages sent to them."""
