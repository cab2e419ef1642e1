"""Speed and memory, measured on real processes, terminals and sockets: `make bench` (issue 2, "Speed and memory")."""
