# SPDX-License-Identifier: GPL-3.0-or-later
"""The present uploads of all ground stations, and which of them must wait for others. Sans-IO."""

from collections.abc import Callable
from math import inf

from bridge.gcs.station import Peer, Station
from bridge.transfers.upload_states import Asking, Complete, Delivering, Receiving, Upload, UploadState, Waiting

#: After this long with lists arriving, an upload does not wait for its turn: a slow or silent ground station would lock
#: out the others. A pause ends that.
_ALONE_S = 4.0
_PAUSE_S = 3.0
#: Nor does it if more than this many are running or waiting.
_MOST_IN_TURN = 4


class UploadQueue:
    """The uploads in the order of their MISSION_COUNT."""

    def __init__(self) -> None:
        self.uploads: list[Upload] = []
        #: When lists began to arrive without a pause, and when the last upload ended.
        self._arriving_since = self._last_end = -inf

    def of(self, station: Station) -> Upload | None:
        """The newest upload of a ground station: one may wait behind another that is being written."""
        for upload in reversed(self.uploads):
            if upload.station == station:
                return upload
        return None

    def within(self, *states: type[UploadState]) -> list[Upload]:
        return [upload for upload in self.uploads if isinstance(upload.state, states)]

    def undelivered(self) -> list[Upload]:
        return [upload for upload in self.uploads if not isinstance(upload.state, Delivering)]

    def least_worth(self, has_standing: Callable[[Peer], bool]) -> Upload:
        """The upload to end if too many run: a stranger's, one without items, the oldest."""

        def worth(upload: Upload) -> tuple[bool, bool, float]:
            return has_standing(upload.station.peer), bool(upload.state.received), upload.state.deadline

        return min(self.undelivered(), key=worth)

    def remove(self, upload: Upload, now: float) -> None:
        self._last_end = now
        self.uploads.remove(upload)

    def due(self, now: float) -> float:
        """When an upload's state is due, or a waiting one may go on although others are arriving."""
        turn = self._arriving_since + _ALONE_S
        times = [upload.state.due for upload in self.uploads]
        return min([*times, turn] if now < turn and self.within(Waiting) else times, default=inf)

    def begins_to_arrive(self, upload: Upload, now: float) -> None:
        """An upload's turn has come."""
        if self.within(Asking, Receiving) == [upload] and now >= self._last_end + _PAUSE_S:
            self._arriving_since = now

    def must_wait(self, now: float) -> bool:
        """True while the list of another upload is arriving as it should."""
        is_early = now < self._arriving_since + _ALONE_S and len(self.uploads) <= _MOST_IN_TURN
        return is_early and bool(self.within(Asking, Receiving, Complete))
