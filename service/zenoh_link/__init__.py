# SPDX-License-Identifier: GPL-3.0-or-later
"""The daemon's side of Eclipse zenoh: docs/zenoh.md. Imported only if zenoh is enabled."""
