"""The running program: event loop, sockets, serial ports, files, signals, command line."""
