-- Every mission received. Times are unix seconds.

-- The columns in a list of missions. The bulk is apart, so that listing thousands reads few pages.
CREATE TABLE IF NOT EXISTS missions (
    number        INTEGER PRIMARY KEY AUTOINCREMENT,  -- a number is never given twice
    received_at   REAL    NOT NULL,
    source        TEXT    NOT NULL,
    verdict       TEXT    NOT NULL,
    ack           TEXT    NOT NULL,
    item_count    INTEGER NOT NULL,
    finding_count INTEGER NOT NULL,
    record_count  INTEGER NOT NULL,
    checksum      INTEGER NOT NULL,
    outcome       TEXT    NOT NULL,
    detail        TEXT    NOT NULL,
    concluded_at  REAL,                               -- NULL while the outcome is PENDING
    sender        TEXT    NOT NULL DEFAULT '',        -- the ground station, until it has read the mission back
    crc32         INTEGER                             -- over the columns above but sender, in their order
) STRICT;

-- JSON as Python writes it: a parameter that was not given is NaN.
CREATE TABLE IF NOT EXISTS mission_contents (
    number       INTEGER PRIMARY KEY REFERENCES missions (number),
    items        TEXT    NOT NULL,
    findings     TEXT    NOT NULL,
    stored_items TEXT    NOT NULL,
    roi_commands TEXT    NOT NULL,
    records      BLOB    NOT NULL,
    sent_seqs    TEXT    NOT NULL,                    -- for each stored item, its number as sent; null: inserted
    crc32        INTEGER NOT NULL                     -- over the columns above, in their order
) STRICT;

-- Read-back asks: which verified mission is it that the flight controller holds?
CREATE INDEX IF NOT EXISTS missions_verified ON missions (record_count, checksum) WHERE outcome = 'VERIFIED';

-- Tables of a flight controller's settings, one for each change.
CREATE TABLE IF NOT EXISTS settings_backups (
    number        INTEGER PRIMARY KEY AUTOINCREMENT,  -- a number is never given twice
    board         TEXT    NOT NULL,                   -- distinguishes boards of one kind
    kind          TEXT    NOT NULL,                   -- the firmware and its version
    taken_at      REAL    NOT NULL,
    occasion      TEXT    NOT NULL,                   -- why it was taken
    setting_count INTEGER NOT NULL,
    changed_count INTEGER,                            -- since this board's last one; NULL for its first
    contents      TEXT    NOT NULL,                   -- JSON: the values by name
    crc32         INTEGER NOT NULL                    -- over the columns above, in their order
) STRICT;
CREATE INDEX IF NOT EXISTS settings_backups_of_board ON settings_backups (board, kind);
