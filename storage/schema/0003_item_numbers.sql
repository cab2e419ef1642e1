-- JSON: for each stored item, its number as sent, or null for an inserted one; empty in missions of older releases.
-- Part of the checksum: an empty text does not change it.
ALTER TABLE mission_contents ADD COLUMN sent_seqs TEXT NOT NULL DEFAULT '';
-- The ground station that sent it; empty for other sources, and once the station has read the mission back.
ALTER TABLE missions ADD COLUMN sender TEXT NOT NULL DEFAULT '';
