"""Questions on kinematics."""
