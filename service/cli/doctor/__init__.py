# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge doctor`: finds problems of the machine that affect the bridge, with remedies.

Each check is a function of the `Host`; `examination.py` lists them.
"""
