"""Making a robot file of schema `robot-facts/1` from a URDF or a Denavit–Hartenberg table.

A description is read into an `ImportedChain` (`urdf`, `urdf_chain`, `dh_file`); `configuration`
does the four steps that turn it into a robot, and says of each fact whether it was read, asked for
or assumed; `cli` is the command. Nothing outside this package needs it: what it makes is a file.
"""
