# SPDX-License-Identifier: GPL-3.0-or-later
"""The running bridge on the event loop, the requests that it answers, and the client that sends them.

The client (`client.py`) does not import any other part of the daemon.
"""
