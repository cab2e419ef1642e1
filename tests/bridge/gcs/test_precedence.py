# SPDX-License-Identifier: GPL-3.0-or-later
"""Precedence, which is updated without sorting for each packet, always equals the one computed by the rules."""

import random
from collections import Counter

import pytest

from bridge.gcs.station import Peer, Station
from bridge.gcs.stations import MAX_PEERS, PRECEDENCE, Stations


class Model:
    """The rules, applied to all peers each time."""

    def __init__(self) -> None:
        self.heard_at: dict[Peer, float] = {}  # in order of arrival
        self.beats: Counter[Peer] = Counter()

    def heard(self, peer: Peer, now: float) -> None:
        self.heard_at[peer] = now
        self.beats[peer] += 1

    def gone(self, peer: Peer) -> None:
        del self.heard_at[peer], self.beats[peer]

    def first(self) -> list[Peer]:
        numbers: Counter[tuple[bool, object]] = Counter()
        ranks = {}
        for peer in self.heard_at:
            group = self.beats[peer] < 3, peer.host
            numbers[group] += 1
            ranks[peer] = group[0], numbers[group]
        return sorted(self.heard_at, key=lambda peer: ranks[peer])[:PRECEDENCE]

    def displaced(self) -> Peer:
        first, hosts = self.first(), Counter(peer.host for peer in self.heard_at)
        later = [peer for peer in self.heard_at if peer not in first]
        return min(later, key=lambda peer: (-hosts[peer.host], self.heard_at[peer]))


@pytest.mark.parametrize("hosts", [3, 12, 40, 400])
def test_precedence_and_displacement_follow_the_rules(hosts: int) -> None:
    chance, stations, model, now = random.Random(hosts), Stations(), Model(), 0.0
    displaced = 0
    for step in range(1500):
        now += 1.0
        known = list(model.heard_at)
        new = Peer("udp", (f"10.0.{chance.randrange(hosts)}.1", step))
        peer = chance.choice(known) if known and chance.random() < 0.4 else new
        if peer is not new and chance.random() < 0.2:
            stations.gone(peer)
            model.gone(peer)
            continue
        if peer is new and len(known) == MAX_PEERS:
            model.gone(model.displaced())
            displaced += 1
        model.heard(peer, now)
        stations.heard(Station(peer, 255, 190), 2, now)
        if step % 10 == 0:
            assert set(stations.peers()) == set(model.heard_at)
            first = model.first()
            assert [peer for peer in model.heard_at if stations.has_standing(peer)] == sorted(
                first, key=list(model.heard_at).index
            )
            assert list(stations.hosts_with_precedence()) == list(dict.fromkeys(peer.host for peer in first))
    assert displaced > 50
