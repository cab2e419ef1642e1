# SPDX-License-Identifier: GPL-3.0-or-later
"""Files of the repository that are made from the code: pages, the sample configuration, schemas, tables (Makefile).

Not part of what is installed.
"""
