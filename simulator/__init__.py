# SPDX-License-Identifier: GPL-3.0-or-later
"""The simulated Naze: a Harakiri flight controller that lies well enough to be tested against."""
