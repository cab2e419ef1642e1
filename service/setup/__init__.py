# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge setup`: from a bare Raspberry Pi to a service that ground stations can connect to.

`steps.py` compares the machine with what is wanted and yields the changes; `change.py` carries them out; a second run
finds nothing left to do.
"""
