# SPDX-License-Identifier: GPL-3.0-or-later
"""The present uploads of all ground stations, and which of them must wait for others. Sans-IO."""

from collections import Counter
from collections.abc import Callable, Iterator
from math import inf

from bridge.gcs.station import Peer, Station
from bridge.transfers.upload_states import Asking, Complete, Delivering, Receiving, Upload, UploadState

#: A host with more uploads than this is the first to lose one.
_MOST_OF_HOST = 2
#: After this long with lists arriving, an upload does not wait for its turn: a slow or silent ground station would lock
#: out the others. A pause ends that.
_ALONE_S = 4.0
_PAUSE_S = 3.0
#: Nor does it if more than this many are running or waiting.
_MOST_IN_TURN = 4


class UploadList:
    """The uploads in the order of their MISSION_COUNT."""

    def __init__(self) -> None:
        self._uploads: list[Upload] = []
        self._states: Counter[type[UploadState]] = Counter()
        #: No state ends and no request is repeated before this time.
        self.due = inf
        #: When lists began to arrive without a pause, and when the last upload ended.
        self._arriving_since = self._last_end = -inf

    def __iter__(self) -> Iterator[Upload]:
        return iter(self._uploads)

    def __len__(self) -> int:
        return len(self._uploads)

    def add(self, upload: Upload) -> None:
        self._uploads.append(upload)
        self._entered(upload)

    def change(self, upload: Upload, state: UploadState) -> None:
        self._states[type(upload.state)] -= 1
        upload.state = state
        self._entered(upload)

    def remove(self, upload: Upload, now: float) -> None:
        self._last_end = now
        self._uploads.remove(upload)
        self._states[type(upload.state)] -= 1

    def _entered(self, upload: Upload) -> None:
        self._states[type(upload.state)] += 1
        self.schedule(upload)

    def schedule(self, upload: Upload) -> None:
        """Note that an upload may be due sooner."""
        self.due = min(self.due, upload.next_tick())

    def of(self, station: Station) -> Upload | None:
        """The newest upload of a ground station: one may wait behind another that is being written."""
        return next((upload for upload in reversed(self._uploads) if upload.station == station), None)

    def has(self, *states: type[UploadState]) -> bool:
        """True if an upload is in one of these states."""
        return any(self._states[state] for state in states)

    def within(self, *states: type[UploadState]) -> list[Upload]:
        """The uploads in these states."""
        return [upload for upload in self._uploads if type(upload.state) in states] if self.has(*states) else []

    def undelivered(self) -> list[Upload]:
        return [upload for upload in self._uploads if not isinstance(upload.state, Delivering)]

    def least_worth(self, has_standing: Callable[[Peer], bool]) -> Upload:
        """The upload to end if too many run: a crowded host's, else a stranger's, one without items, the oldest."""
        hosts = Counter(upload.station.peer.host for upload in self._uploads)

        def worth(upload: Upload) -> tuple[int, bool, bool, float]:
            peer, state = upload.station.peer, upload.state
            crowd = max(hosts[peer.host], _MOST_OF_HOST)
            return -crowd, has_standing(peer), bool(state.received), state.since

        return min(self.undelivered(), key=worth)

    # Taking turns.

    def begins_to_arrive(self, upload: Upload, now: float) -> None:
        """An upload's turn has come."""
        if self.within(Asking, Receiving) == [upload] and now >= self._last_end + _PAUSE_S:
            self._arriving_since = now

    @property
    def waits_until(self) -> float:
        """The time from which no upload waits for another that is still arriving."""
        return self._arriving_since + _ALONE_S

    def must_wait(self, now: float) -> bool:
        """True while the list of another upload is arriving as it should."""
        is_busy = self.has(Asking, Receiving, Complete)
        return is_busy and now < self.waits_until and len(self._uploads) <= _MOST_IN_TURN
