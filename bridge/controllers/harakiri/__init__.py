# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri: the mission rules, record format and upload over MSP or MAVLink."""
