"""The core that pendants with a display share: keys, state and time in, commands and texts out."""
