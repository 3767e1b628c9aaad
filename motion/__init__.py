"""Motion: robot facts and joint-space mathematics, without protocol, sockets or clock.

Nothing is imported here: `description` and `errors` are plain data that the emulator loads without
numpy, while `kinematics` and `timing` each bring one heavy library.
"""
