# SPDX-License-Identifier: GPL-3.0-or-later
"""The ground stations: which are connected, what each may do, and what is sent to them."""
