# SPDX-License-Identifier: GPL-3.0-or-later
"""Requests to a running daemon over its control socket. No part of the daemon itself is imported."""
