# SPDX-License-Identifier: GPL-3.0-or-later
"""The running program: event loop, sockets, serial ports, files, signals, command line."""
