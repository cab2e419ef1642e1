# SPDX-License-Identifier: GPL-3.0-or-later
"""The root helper: carries out the status page's changes to this Pi, because the daemon has no privileges.

systemd starts it for each connection to its socket, which only the service's user may open. A connection carries one
request, a line of JSON such as {"action": "fix", "fix": "restart the bridge"}, and one reply. `actions.py` has all
actions; there is no other, and none runs a shell or a program that the request names.
"""
