-- Tables of a flight controller's settings, one for each change. Times are unix seconds.
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
