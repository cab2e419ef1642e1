# SPDX-License-Identifier: GPL-3.0-or-later
"""Plain data that the daemon and its clients exchange: zenoh's keys, payloads and endpoints; missions as JSON."""
