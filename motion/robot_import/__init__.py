"""Import of a robot: from a URDF or a Denavit–Hartenberg table to a file of `robot-facts/1`.

`urdf` with `urdf_tree`, and `dh_file`, read a description into an `ImportedChain`. `new_robot`
turns it into a robot in four steps and states for each fact whether it was read, asked for or
assumed. Only the command in `cli/robots_import` uses this package: all others read its result, a
robot file.
"""
