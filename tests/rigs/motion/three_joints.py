"""Two turns and a slide with round limits, and a way between two places of them."""

from openpendant.motion.description.limits import JointLimits

THREE = JointLimits(
    names=("turn", "tilt", "slide"),
    lower=(-3.0, -2.0, -1.0),
    upper=(3.0, 2.0, 1.0),
    velocity=(2.0, 1.5, 0.5),
    acceleration=(8.0, 6.0, 2.0),
    prismatic=(False, False, True),
)
START, GOAL = [0.0, 0.5, -0.2], [2.0, -0.5, 0.3]
