# SPDX-License-Identifier: GPL-3.0-or-later
"""What a board is plugged into: a pseudo-terminal, a TCP socket, or a test's own loop."""
