# SPDX-License-Identifier: GPL-3.0-or-later
"""The status page, for browsers on the Pi's Wi-Fi. Imported only if it is configured."""
