"""The keypad pendant: 16 keys and a display on a serial line, and the bridge that serves them."""
