# SPDX-License-Identifier: GPL-3.0-or-later
"""Other programs (INAV Configurator, MultiWiiConf, mwp) that use MSP through the bridge."""
