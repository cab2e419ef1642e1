# SPDX-License-Identifier: GPL-3.0-or-later
"""A board's connections: a pseudo-terminal, a TCP socket, or a test's own loop."""
