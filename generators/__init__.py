# SPDX-License-Identifier: GPL-3.0-or-later
"""Generate files of the repository from the code: pages, the sample configuration, schemas, tables (Makefile).

Not installed.
"""
