# SPDX-License-Identifier: GPL-3.0-or-later
"""The world around an emulated board: a quadcopter's body, wind, sensor measurements, and a GPS module.

World axes: x north, y west, z up, metres from the launch place. Body axes: x forward, y left, z up. Everything is
seeded, and time is passed in. Sources: Stevens, Lewis, Johnson, "Aircraft Control and Simulation", 3rd edition (rigid
body, quaternions). Each sensor's data sheet.
"""
