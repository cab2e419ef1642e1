# SPDX-License-Identifier: GPL-3.0-or-later
"""The root helper: carries out the status page's changes to this Pi, because the daemon runs without privileges.

systemd starts it for each connection to one of its sockets, which only the service's user may open: one for each set of
privileges (service/machine/helper_socket.py). A connection carries one request, a line of JSON such as
{"action": "fix", "fix": "restart the bridge"}, and one reply. `actions.py` has all actions. They do not run a
shell, or take a command, a path or a process id.
"""
