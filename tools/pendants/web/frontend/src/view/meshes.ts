// Meshes of an imported robot: their bytes come in bounded chunks, one at a time, and are believed
// only where their hash is the one that the server told.
import type { Operations, RobotMesh } from "../operations.ts";
import { pose, type Pose } from "../kinematics/pose.ts";
import { sha256 } from "./sha256.ts";

/** A mesh that has come, and where it is. */
export interface LinkMesh {
  hash: string;
  form: "stl" | "obj";
  bytes: Uint8Array;
  /** metres per unit of the file along x, y, z; negative mirrors */
  scale: readonly number[];
  links: readonly { link: string; pose: Pose }[];
  /** `#rrggbb` */
  colour: string;
}

type MeshOperation = "shapes.meshes" | "shapes.mesh";

/** Asks the server; rejects where it refuses. */
export type Ask = <Op extends MeshOperation>(
  request: Operations[Op][0] & { op: Op },
) => Promise<Operations[Op][1]>;

export interface Waiting {
  /** Wait so long [ms]. */
  (duration: number): Promise<void>;
}

/** Most bytes of all meshes of a robot: the server takes no more at an import. */
export const MOST_BYTES = 64 * 1024 * 1024;
/** Between two chunks [ms]: the server gives 20 a second. */
const BETWEEN = 55;

/** What came of the meshes, and what is wrong with those that did not. */
export interface Download {
  meshes: LinkMesh[];
  problems: { hash: string; problem: "hash" | "size" | "refused"; text: string }[];
}

/**
 * Fetch all meshes of this cell's robot, and tell of each as it comes.
 *
 * A mesh that is refused, too large, or not what its hash says leaves the simple shapes standing.
 */
export async function downloadedMeshes(
  ask: Ask,
  came: (meshes: readonly LinkMesh[]) => void,
  wait: Waiting = (duration) => new Promise((done) => setTimeout(done, duration)),
  signal?: AbortSignal,
): Promise<Download> {
  const { meshes } = await ask({ op: "shapes.meshes" });
  const result: Download = { meshes: [], problems: [] };
  const read = new Map<string, Uint8Array>();
  let left = MOST_BYTES;
  for (const mesh of meshes) {
    if (signal?.aborted === true) break;
    let bytes = read.get(mesh.hash);
    if (bytes === undefined) {
      const found = mesh.bytes > left ? tooLarge(mesh) : await readMesh(mesh, ask, wait, signal);
      if (!(found instanceof Uint8Array)) {
        result.problems.push(found);
        continue;
      }
      bytes = found;
      left -= mesh.bytes;
      read.set(mesh.hash, bytes);
    }
    result.meshes = [...result.meshes, placed(mesh, bytes)];
    came(result.meshes);
  }
  return result;
}

type Problem = Download["problems"][number];

function tooLarge(mesh: RobotMesh): Problem {
  return { hash: mesh.hash, problem: "size", text: String(mesh.bytes) };
}

async function readMesh(
  mesh: RobotMesh,
  ask: Ask,
  wait: Waiting,
  signal?: AbortSignal,
): Promise<Uint8Array | Problem> {
  const bytes = new Uint8Array(mesh.bytes);
  for (let offset = 0; offset < bytes.length; ) {
    if (signal?.aborted === true) return { hash: mesh.hash, problem: "refused", text: "" };
    let data: Uint8Array;
    try {
      const chunk = await ask({ op: "shapes.mesh", hash: mesh.hash, offset });
      data = ofBase64(chunk.data);
    } catch (error) {
      return { hash: mesh.hash, problem: "refused", text: String(error) };
    }
    if (data.length === 0 || offset + data.length > bytes.length) return tooLarge(mesh);
    bytes.set(data, offset);
    offset += data.length;
    if (offset < bytes.length) await wait(BETWEEN);
  }
  const hash = sha256(bytes);
  return hash === mesh.hash ? bytes : { hash: mesh.hash, problem: "hash", text: hash };
}

function ofBase64(text: string): Uint8Array {
  return Uint8Array.from(atob(text), (each) => each.charCodeAt(0));
}

function placed(mesh: RobotMesh, bytes: Uint8Array): LinkMesh {
  return {
    hash: mesh.hash,
    form: mesh.form,
    bytes,
    scale: mesh.unit_scale,
    links: mesh.links.map(({ link, xyz, quat }) => ({ link, pose: pose(xyz, quat) })),
    colour: mesh.colour,
  };
}
