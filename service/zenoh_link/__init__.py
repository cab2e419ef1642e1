"""The daemon's side of Eclipse zenoh: docs/zenoh.md. Imported only if zenoh is switched on."""
