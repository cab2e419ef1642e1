# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge doctor`: looks at the machine and says what is in the way of the bridge, and what to do.

Each check is a function of the `Host` that returns what it found; `examination.py` has the list of them.
"""
