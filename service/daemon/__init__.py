# SPDX-License-Identifier: GPL-3.0-or-later
"""The running bridge on its event loop, and the requests that it answers."""
