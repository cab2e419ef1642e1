# SPDX-License-Identifier: GPL-3.0-or-later
"""The form of an action: a function whose keyword arguments are the request's, checked by name and type."""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from inspect import signature
from typing import BinaryIO

from payloads.mission_data import Json
from service.cli.setup.change import Machine, Step, later
from service.machine.host import Host

#: The reply must arrive at the page before what ends the connection.
DELAY_S = 2
_UNIT = ("naze-bridge", "naze-bridge.service")
_ENDING = ("restart", "try-restart", "disable", "stop")


class HelperRefusal(Exception):
    """A request that is not carried out, in one sentence."""


class DeferredRestarts(Machine):
    """Restarts the bridge only after the reply."""

    def run(self, command: Sequence[str], timeout_s: float = 60) -> str:
        ends_bridge = command[0] == "systemctl" and command[1] in _ENDING and command[-1] in _UNIT
        return super().run(later(command, DELAY_S) if ends_bridge else command, timeout_s)


@dataclass(frozen=True, slots=True)
class ThisPi:
    """The machine to change, and the rest of the connection: an action's body."""

    host: Host
    body: BinaryIO

    def make(self, steps: Sequence[Step]) -> Json:
        machine = DeferredRestarts(self.host)
        for step in steps:
            for change in step.changes:
                machine.carry_out(change)
        return self.shown(steps)

    def shown(self, steps: Sequence[Step]) -> Json:
        return {
            "steps": [{"purpose": each.purpose, "changes": [one.describe() for one in each.changes]} for each in steps],
            "needs_reboot": any(each.needs_reboot for each in steps),
            "cuts_network": any(each.cuts_network for each in steps),
        }


#: One of `actions.ACTIONS`.
Action = Callable[..., Json]


def parse_action(line: bytes, actions: Mapping[str, Action]) -> partial[Json]:
    """Read a request; HelperRefusal if it is none, or has an argument that is missing, unknown or of another type."""
    try:
        request: Json = json.loads(line)
        json.dumps(request, ensure_ascii=False).encode()  # lone surrogates are not text
        action = actions[request.pop("action")]
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
        raise HelperRefusal(f"This is not an action; the actions are {', '.join(actions)}") from None
    known = {name: each for name, each in signature(action).parameters.items() if each.kind is each.KEYWORD_ONLY}
    required = {name for name, each in known.items() if each.default is each.empty}
    if not required <= request.keys() <= known.keys() or any(
        type(value) is not known[name].annotation for name, value in request.items()
    ):
        shown = ", ".join(f"{name} ({each.annotation.__name__})" for name, each in known.items()) or "none"
        raise HelperRefusal(f"The arguments of this action are: {shown}")
    return partial(action, **request)
