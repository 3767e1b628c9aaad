"""Tools for live peers: the proxy, the recorder, the player, and single packets."""
