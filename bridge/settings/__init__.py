# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller's own settings: read as a whole, changed one by one, and saved."""
