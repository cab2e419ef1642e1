# SPDX-License-Identifier: GPL-3.0-or-later
"""The mission transfer under way, as it is shown to people."""

from dataclasses import dataclass
from enum import Enum


class TransferStep(Enum):
    """The two halves of an upload; a push has only the second."""

    RECEIVING = "receiving"
    WRITING = "writing"


@dataclass(frozen=True, slots=True)
class MissionTransfer:
    """`done` of `total` items or records; once all records are written they are read back and verified."""

    source: str
    step: TransferStep
    done: int
    total: int
