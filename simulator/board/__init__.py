# SPDX-License-Identifier: GPL-3.0-or-later
"""The parts that simulated boards share: power, wires, rings, sensors, MSP, and a craft that flies."""
