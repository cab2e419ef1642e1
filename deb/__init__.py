# SPDX-License-Identifier: GPL-3.0-or-later
"""The Debian package: `build.py` makes it, `tree.py` lays out the files. The other files go into it unchanged."""
