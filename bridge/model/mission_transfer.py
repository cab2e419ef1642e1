# SPDX-License-Identifier: GPL-3.0-or-later
"""The progress of a running mission transfer, for display."""

from dataclasses import dataclass
from enum import Enum


class TransferStep(Enum):
    """The two halves of an upload; a push has only the second."""

    RECEIVING = "receiving"
    WRITING = "writing"


@dataclass(frozen=True, slots=True)
class MissionTransfer:
    """`done` of `total` items or records. All records written does not mean verified: read-back follows."""

    source: str
    step: TransferStep
    done: int
    total: int
