# SPDX-License-Identifier: GPL-3.0-or-later
"""The texts for pilots: the table of all sentences, and how each kind of ground station shows them."""
