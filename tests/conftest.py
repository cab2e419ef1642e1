# SPDX-License-Identifier: GPL-3.0-or-later
"""For all tests."""

from hypothesis import settings

# Elapsed time is never judged: the machine may be busy with something else.
settings.register_profile("unhurried", deadline=None)
settings.load_profile("unhurried")
