# SPDX-License-Identifier: GPL-3.0-or-later
"""The status page: what a browser on the Pi's Wi-Fi sees of the daemon. Imported only if it is configured."""
