-- Every mission received. Times are unix seconds.

-- What a list of missions shows. The bulk is apart, so that listing thousands reads few pages.
CREATE TABLE missions (
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
    concluded_at  REAL                                -- NULL while the outcome is PENDING
) STRICT;

-- JSON as Python writes it: a parameter that was not given is NaN.
CREATE TABLE mission_contents (
    number       INTEGER PRIMARY KEY REFERENCES missions (number),
    items        TEXT    NOT NULL,
    findings     TEXT    NOT NULL,
    stored_items TEXT    NOT NULL,
    roi_commands TEXT    NOT NULL,
    records      BLOB    NOT NULL,
    crc32        INTEGER NOT NULL                     -- over the five columns above, in their order
) STRICT;

-- Read-back asks: which verified mission is it that the flight controller holds?
CREATE INDEX missions_verified ON missions (record_count, checksum) WHERE outcome = 'VERIFIED';
