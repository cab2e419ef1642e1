# SPDX-License-Identifier: GPL-3.0-or-later
"""The MAVLink vehicle that ground stations see: the telemetry and the services it answers."""
