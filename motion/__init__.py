"""Robot facts and joint-space mathematics: no protocol, no sockets, no clock.

Nothing is imported here: `robot`, `limits` and `errors` are plain data that the emulator loads
without numpy, while `kinematics` and `timing` each bring one heavy library.
"""
