# SPDX-License-Identifier: GPL-3.0-or-later
"""One serial line: requests and replies in MSP, MAVLink frames, and the conversations that use them."""
