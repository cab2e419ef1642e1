# SPDX-License-Identifier: GPL-3.0-or-later
"""`naze-bridge fleet`: many vehicles over zenoh, seen and served from one place. Page: docs/fleet.md."""
