// Poses and the algebra on them: metres; unit quaternions x, y, z, w; roll, pitch, yaw as
// R = Rz(yaw) Ry(pitch) Rx(roll), the conventions of the wire. Formulas: J. Diebel, Representing
// Attitude, 2006.

export type Vector3 = readonly [number, number, number];
/** x, y, z, w */
export type Quaternion = readonly [number, number, number, number];
/** A placement in some frame, which whoever passes it names. */
export interface Pose {
  readonly position: Vector3;
  readonly quaternion: Quaternion;
}

export const NO_ROTATION: Quaternion = [0, 0, 0, 1];
export const IDENTITY: Pose = { position: [0, 0, 0], quaternion: NO_ROTATION };

/** Cosine of the pitch below which roll and yaw are about one axis. */
const GIMBAL = 1e-9;

export function vector3(values: readonly number[]): Vector3 {
  const [x = 0, y = 0, z = 0] = values;
  return [x, y, z];
}

/** Return the unit quaternion of four numbers; no rotation where they are all but zero. */
export function unitQuaternion(values: readonly number[]): Quaternion {
  const [x = 0, y = 0, z = 0, w = 1] = values;
  const norm = Math.hypot(x, y, z, w);
  return norm > 1e-6 ? [x / norm, y / norm, z / norm, w / norm] : NO_ROTATION;
}

export function pose(position: readonly number[], quaternion: readonly number[]): Pose {
  return { position: vector3(position), quaternion: unitQuaternion(quaternion) };
}

export function added(a: Vector3, b: Vector3): Vector3 {
  return [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
}

export function difference(a: Vector3, b: Vector3): Vector3 {
  return [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
}

export function scaled(a: Vector3, factor: number): Vector3 {
  return [a[0] * factor, a[1] * factor, a[2] * factor];
}

export function dot(a: Vector3, b: Vector3): number {
  return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

export function cross(a: Vector3, b: Vector3): Vector3 {
  return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
}

export function distance(a: Vector3, b: Vector3): number {
  return Math.hypot(a[0] - b[0], a[1] - b[1], a[2] - b[2]);
}

/** Return the rotation `right`, then `left`. */
export function product(left: Quaternion, right: Quaternion): Quaternion {
  const [a, b, c, d] = left;
  const [x, y, z, w] = right;
  return [
    d * x + a * w + b * z - c * y,
    d * y - a * z + b * w + c * x,
    d * z + a * y - b * x + c * w,
    d * w - a * x - b * y - c * z,
  ];
}

export function conjugate(q: Quaternion): Quaternion {
  return [-q[0], -q[1], -q[2], q[3]];
}

export function rotated(q: Quaternion, v: Vector3): Vector3 {
  const axis: Vector3 = [q[0], q[1], q[2]];
  const twice = scaled(cross(axis, v), 2);
  return added(added(v, scaled(twice, q[3])), cross(axis, twice));
}

/** Return a point of the pose's frame in the frame that the pose is in. */
export function transformed(by: Pose, point: Vector3): Vector3 {
  return added(by.position, rotated(by.quaternion, point));
}

/** Return a pose of the frame `outer` in the frame that `outer` is in. */
export function composed(outer: Pose, inner: Pose): Pose {
  return {
    position: transformed(outer, inner.position),
    quaternion: unitQuaternion(product(outer.quaternion, inner.quaternion)),
  };
}

export function inverse(of: Pose): Pose {
  const back = conjugate(of.quaternion);
  return { position: rotated(back, scaled(of.position, -1)), quaternion: back };
}

/** Return the rotation by an angle [rad] about a unit axis. */
export function aboutAxis(axis: Vector3, angle: number): Quaternion {
  const sine = Math.sin(angle / 2);
  return [axis[0] * sine, axis[1] * sine, axis[2] * sine, Math.cos(angle / 2)];
}

/** Return the rotation by a rotation vector: axis times angle [rad]. */
export function ofRotationVector(vector: Vector3): Quaternion {
  const angle = Math.hypot(...vector);
  return angle < 1e-12 ? NO_ROTATION : aboutAxis(scaled(vector, 1 / angle), angle);
}

/** Return the least rotation that moves z to a unit direction. */
export function zTowards(direction: Vector3): Quaternion {
  const [x, y, z] = direction;
  return z < -1 + 1e-12 ? [1, 0, 0, 0] : unitQuaternion([-y, x, 0, 1 + z]);
}

export function ofRpy(rpy: readonly number[]): Quaternion {
  const [roll = 0, pitch = 0, yaw = 0] = rpy;
  const [sr, cr] = [Math.sin(roll / 2), Math.cos(roll / 2)];
  const [sp, cp] = [Math.sin(pitch / 2), Math.cos(pitch / 2)];
  const [sy, cy] = [Math.sin(yaw / 2), Math.cos(yaw / 2)];
  return [
    sr * cp * cy - cr * sp * sy,
    cr * sp * cy + sr * cp * sy,
    cr * cp * sy - sr * sp * cy,
    cr * cp * cy + sr * sp * sy,
  ];
}

/** Return the rows of the 3 × 3 rotation matrix. */
export function rotationRows(q: Quaternion): [Vector3, Vector3, Vector3] {
  const [x, y, z, w] = q;
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
  ];
}

/** Return roll, pitch, yaw [rad]; the roll is 0 at a pitch of ±π/2, as the server has it. */
export function rollPitchYaw(q: Quaternion): Vector3 {
  const [first, second, third] = rotationRows(q);
  const cosine = Math.hypot(first[0], second[0]);
  const pitch = Math.atan2(-third[0], cosine);
  if (cosine < GIMBAL) return [0, pitch, Math.atan2(-first[1], second[1])];
  return [Math.atan2(third[1], third[2]), pitch, Math.atan2(second[0], first[0])];
}

/** Return the rows of the homogeneous 4 × 4 matrix. */
export function homogeneous(of: Pose): number[][] {
  const rows = rotationRows(of.quaternion).map((row, index) => [...row, of.position[index] ?? 0]);
  return [...rows, [0, 0, 0, 1]];
}
