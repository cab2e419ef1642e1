# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge setup`: turns a bare Raspberry Pi into a service that ground stations can connect to.

`steps.py` compares the machine with the desired state and yields the changes; `change.py` makes them; a second run
changes nothing.
"""
