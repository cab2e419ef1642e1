# SPDX-License-Identifier: GPL-3.0-or-later
"""The flight controller's settings: read, watched, changed and saved; as parameters, and for local clients."""
