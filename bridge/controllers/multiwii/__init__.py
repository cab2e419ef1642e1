# SPDX-License-Identifier: GPL-3.0-or-later
"""MultiWii 2.4 NAV."""
