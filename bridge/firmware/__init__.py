# SPDX-License-Identifier: GPL-3.0-or-later
"""New firmware for a Harakiri over the serial port."""
