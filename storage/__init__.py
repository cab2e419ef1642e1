"""Missions on disk. Knows SQLite and nothing of MAVLink or MSP."""
