# SPDX-License-Identifier: GPL-3.0-or-later
"""Whole flights of a real firmware image in the simulated sky: a pilot, the track flown, and the judgement."""
