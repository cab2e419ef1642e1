# SPDX-License-Identifier: GPL-3.0-or-later
"""MultiWii Serial Protocol, version 1."""
