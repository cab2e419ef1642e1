# SPDX-License-Identifier: GPL-3.0-or-later
"""Harakiri: its mission rules, record format and upload over MSP or MAVLink."""
