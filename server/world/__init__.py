"""What surrounds the robot: frames, tools, scene, inputs and outputs, the trace of the tool."""
