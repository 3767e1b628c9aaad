// The words of the page for the curious: frames, matrices, the Jacobian, the specification.

export const numbersEn = {
  where: "Where the tool is",
  frame: "Frame",
  link: "Link",
  toolCentre: "tool centre point",
  position: "Position [mm]",
  quaternion: "Quaternion x y z w",
  rpy: "Roll, pitch, yaw [°]",
  notUnique: "at a pitch of 90° roll and yaw are not unique",
  axisAngle: "Rotation vector [°]",
  matrix: "Homogeneous matrix [m]",
  jacobian: "Jacobian, rows vx vy vz ωx ωy ωz",
  condition: "Condition number",
  infinite: "infinite",
  manipulability: "Manipulability",
  singularity: "Nearest singularity",
  singular: (kind: string, distance: string) => `${kind}, ${distance}`,
  kinds: { wrist: "wrist", elbow: "elbow", shoulder: "shoulder", unnamed: "unnamed" } as Record<string, string>,
  dh: "DH frames",
  dhJoint: "Joint",
  noDh: "This robot's file has no DH table.",
  dhHint: "a, d in mm; α, θ in degrees; shown in the picture.",
  specification: "Specification",
  limits: "Limits of the joints",
  range: "Range",
  greatest: "Speed, acceleration",
  showFrames: "Show them in the picture",
  live: "It follows the robot twice a second.",
};

export type NumberTexts = typeof numbersEn;
