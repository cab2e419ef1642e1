# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge fleet`: manages many vehicles over zenoh from one place. Page: docs/fleet.md."""
