# SPDX-License-Identifier: GPL-3.0-or-later
"""Speed and memory, measured on real processes, terminals and sockets: `make bench`."""
