# SPDX-License-Identifier: GPL-3.0-or-later
"""Files on disk: the missions, in SQLite, and small files. Without knowledge of MAVLink or MSP."""
