# SPDX-License-Identifier: GPL-3.0-or-later
"""What the commands of service/ and fleet/ share: groups of commands, sentences, tables, mission files."""
