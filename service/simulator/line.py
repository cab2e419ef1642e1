"""What a UART makes of bytes that were sent at another speed."""

_IDLE = 1


def garble(data: bytes, sent_baud: int, read_baud: int) -> bytes:
    """Return the bytes that a receiver at `read_baud` samples from `data` sent back to back at `sent_baud`.

    8N1 as the STM32's UART does it: a start bit is looked for on the idle line, each bit is sampled in its
    middle, and a byte with a bad stop bit is delivered all the same.
    """
    if sent_baud == read_baud:
        return data
    wire = [bit for byte in data for bit in (0, *(byte >> shift & 1 for shift in range(8)), 1)]
    read_bits_per_sent = read_baud / sent_baud

    def level(at: float) -> int:
        """Return the line's level at a time in receiver bits."""
        index = int(at / read_bits_per_sent)
        return wire[index] if index < len(wire) else _IDLE

    # The receiver looks for the falling edge with 16 samples a bit.
    sampled = bytearray()
    at, end = 0.0, len(wire) * read_bits_per_sent
    while at < end:
        if level(at):
            at += 1 / 16
            continue
        sampled.append(sum(level(at + 1.5 + bit) << bit for bit in range(8)))
        at += 9.5
        while at < end and not level(at):
            at += 1 / 16
    return bytes(sampled)
