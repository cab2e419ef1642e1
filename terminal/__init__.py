# SPDX-License-Identifier: GPL-3.0-or-later
"""Shared by the commands of service/ and fleet/: groups of commands, sentences, tables, mission files."""
