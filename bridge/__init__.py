"""What the bridge decides. Sans-IO: time and bytes are passed in, effects are handed out."""
