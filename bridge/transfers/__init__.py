# SPDX-License-Identifier: GPL-3.0-or-later
"""Mission transfers: ground stations' uploads and downloads, and those of the command line, status page and zenoh."""
