# SPDX-License-Identifier: GPL-3.0-or-later
"""The computer that the bridge runs on: files, programs, network, systemd, the log, the installed package."""
