"""Speed and memory, measured on real processes, terminals and sockets: `make bench`."""
