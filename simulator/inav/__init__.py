# SPDX-License-Identifier: GPL-3.0-or-later
"""A model of INAV."""
