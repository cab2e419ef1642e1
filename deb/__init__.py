# SPDX-License-Identifier: GPL-3.0-or-later
"""The Debian package: `build.py` makes it, `tree.py` says what is where; the rest goes into it as it is."""
