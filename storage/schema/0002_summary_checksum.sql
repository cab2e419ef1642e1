-- A changed byte in a mission's line is noticed, too: crc32 over its other columns, in their order.
ALTER TABLE missions ADD COLUMN crc32 INTEGER;
UPDATE missions SET crc32 = row_crc32(number, received_at, source, verdict, ack, item_count, finding_count, record_count,
                                      checksum, outcome, detail, concluded_at);
