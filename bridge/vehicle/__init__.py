# SPDX-License-Identifier: GPL-3.0-or-later
"""The MAVLink vehicle that ground stations see: its telemetry and the services it answers."""
