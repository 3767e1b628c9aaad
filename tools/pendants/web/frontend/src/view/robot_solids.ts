// A robot in three.js: its simple shapes, its rods, and the meshes that have come, at joint values.
import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CapsuleGeometry,
  Color,
  CylinderGeometry,
  Group,
  Mesh,
  MeshLambertMaterial,
  MeshStandardMaterial,
  SphereGeometry,
  type MeshStandardMaterialParameters,
  type Object3D,
} from "three";
import { OBJLoader } from "three/addons/loaders/OBJLoader.js";
import { STLLoader } from "three/addons/loaders/STLLoader.js";

import type { Chain } from "../kinematics/chain.ts";
import {
  difference,
  scaled,
  transformed,
  vector3,
  zTowards,
  type Pose,
} from "../kinematics/pose.ts";
import type { DrawnStrut } from "../operations.ts";
import { linkJoint, linksInPlace } from "./changes.ts";
import { ORANGE, verdictColour } from "./colours.ts";
import type { LinkMesh } from "./meshes.ts";
import type { Solid } from "./solids.ts";
import type { Ghost } from "./view.ts";

const SEGMENTS = { fine: 32, coarse: 14 } as const;
const GHOST_OPACITY = 0.4;

/** How a robot is painted: all of it in one colour, with moving joints, or as a ghost. */
export interface Paint {
  all?: string;
  driven?: readonly number[];
  ghost?: Ghost["verdict"];
}

interface Part {
  mesh: Mesh<BufferGeometry, SolidMaterial>;
  colour: string;
  /** number of the driven joint that it shows; -1 for none */
  joint: number;
}

export class RobotSolids {
  readonly group = new Group();
  readonly #isFine: boolean;
  readonly #asks: () => void;
  readonly #links = new Map<string, Group>();
  readonly #struts: { strut: DrawnStrut; part: Part }[] = [];
  #parts: Part[] = [];
  #chain: Chain | null = null;
  #drawn = new WeakMap<LinkMesh, true>();

  constructor(isFine: boolean, asks: () => void) {
    this.#isFine = isFine;
    this.#asks = asks;
  }

  takeRobot(chain: Chain | null): void {
    emptied(this.group);
    this.#links.clear();
    this.#struts.length = 0;
    this.#parts = [];
    this.#drawn = new WeakMap();
    this.#chain = chain;
    if (chain === null) return;
    for (const { link } of chain.robot.links) {
      const group = new Group();
      this.#links.set(link, group);
      this.group.add(group);
    }
    for (const shape of chain.robot.shapes) {
      const joint = shape.part === "joint" ? linkJoint(chain, shape.link) : -1;
      const part = this.#part(solidGeometry(shape, this.#isFine), shape.colour, joint);
      part.mesh.position.set(...vector3(shape.xyz));
      part.mesh.quaternion.fromArray([...shape.quat]);
      this.#links.get(shape.link)?.add(part.mesh);
    }
    for (const strut of chain.robot.struts) {
      const joint = chain.driven.findIndex((each) => each.name === strut.name);
      const rod = { form: "cylinder", size: [strut.diameter, strut.diameter, 1] };
      const part = this.#part(solidGeometry(rod, this.#isFine), strut.colour, joint);
      this.group.add(part.mesh);
      this.#struts.push({ strut, part });
    }
  }

  /** Show meshes in place of the simple shapes of their links; one that cannot be read is left. */
  takeMeshes(meshes: readonly LinkMesh[]): void {
    for (const mesh of meshes) {
      if (this.#drawn.has(mesh)) continue;
      this.#drawn.set(mesh, true);
      const geometry = meshGeometry(mesh);
      if (geometry === null) continue;
      for (const { link, pose } of mesh.links) this.#putMesh(mesh, geometry, link, pose);
      this.#asks();
    }
  }

  /** Put the links at joint values; those that are there at the values of `besides` too are hidden. */
  pose(
    joints: readonly number[] | null,
    paint: Paint,
    besides: { joints: readonly number[] | null } | null = null,
  ): void {
    if (this.#chain === null) return;
    const places = this.#chain.linkPoses(joints);
    const hidden = besides === null ? null : linksInPlace(places, this.#chain.linkPoses(besides.joints));
    for (const [link, group] of this.#links) {
      put(group, places.get(link) ?? this.#chain.root);
      group.visible = hidden === null || !hidden.has(link);
    }
    for (const { strut, part } of this.#struts) this.#stretch(strut, part.mesh, places);
    const moves = new Set(paint.driven ?? []);
    for (const { mesh, colour, joint } of this.#parts) {
      const own = moves.has(joint) ? ORANGE : colour;
      const shown = paint.ghost === undefined ? (paint.all ?? own) : verdictColour(paint.ghost);
      mesh.material.color.set(shown);
      const isGhost = paint.ghost !== undefined;
      if (mesh.material.transparent === isGhost) continue;
      Object.assign(mesh.material, { transparent: isGhost, needsUpdate: true });
      mesh.material.opacity = isGhost ? GHOST_OPACITY : 1;
      mesh.castShadow = mesh.receiveShadow = !isGhost && this.#isFine;
    }
  }

  #part(geometry: BufferGeometry, colour: string, joint: number): Part {
    const material = solidMaterial({ color: new Color(colour), roughness: 0.55 }, this.#isFine);
    const mesh = new Mesh(geometry, material);
    mesh.castShadow = mesh.receiveShadow = this.#isFine;
    const part = { mesh, colour, joint };
    this.#parts.push(part);
    return part;
  }

  #putMesh(mesh: LinkMesh, geometry: BufferGeometry, link: string, at: Pose): void {
    const group = this.#links.get(link);
    if (group === undefined) return;
    for (const each of group.children) each.visible = each.userData["isMesh"] === true;
    const part = this.#part(geometry, mesh.colour, -1);
    const [x = 1, y = 1, z = 1] = mesh.scale;
    part.mesh.scale.set(x, y, z);
    part.mesh.userData["isMesh"] = true;
    put(part.mesh, at);
    group.add(part.mesh);
  }

  #stretch(strut: DrawnStrut, mesh: Mesh, places: ReadonlyMap<string, Pose>): void {
    const root = this.#chain?.root;
    const [one, other] = [places.get(strut.first_link) ?? root, places.get(strut.second_link) ?? root];
    if (one === undefined || other === undefined) return;
    const first = transformed(one, vector3(strut.first));
    const along = difference(transformed(other, vector3(strut.second)), first);
    const length = Math.max(1e-6, Math.hypot(...along));
    mesh.position.set(...transformed({ position: first, quaternion: [0, 0, 0, 1] }, scaled(along, 0.5)));
    mesh.quaternion.fromArray([...zTowards(scaled(along, 1 / length))]);
    mesh.scale.set(1, 1, length);
  }
}

export type SolidMaterial = MeshStandardMaterial | MeshLambertMaterial;

/** Return what a solid is painted with; without gloss where software draws, which has less to do. */
export function solidMaterial(
  { roughness, ...plain }: MeshStandardMaterialParameters & { roughness: number },
  isFine: boolean,
): SolidMaterial {
  return isFine ? new MeshStandardMaterial({ roughness, ...plain }) : new MeshLambertMaterial(plain);
}

/** Return the surface of a simple solid about its middle, round ones along z. */
export function solidGeometry(solid: Solid, isFine: boolean): BufferGeometry {
  const [x = 0, y = 0, z = 0] = solid.size;
  const segments = isFine ? SEGMENTS.fine : SEGMENTS.coarse;
  switch (solid.form) {
    case "sphere":
      return new SphereGeometry(x / 2, segments, segments / 2);
    case "cylinder": {
      // Round what it stands round: with its corners on the circle a link as thick pokes out of its joint.
      const radius = x / 2 / Math.cos(Math.PI / segments);
      return new CylinderGeometry(radius, radius, z, segments).rotateX(Math.PI / 2);
    }
    case "capsule":
      return new CapsuleGeometry(x / 2, Math.max(0, z - x), segments / 4, segments).rotateX(
        Math.PI / 2,
      );
    default:
      return new BoxGeometry(x, y, z);
  }
}

/** Return the surface in a mesh file; null where it cannot be read. */
function meshGeometry(mesh: LinkMesh): BufferGeometry | null {
  try {
    const geometry = mesh.form === "stl" ? ofStl(mesh.bytes) : ofObj(mesh.bytes);
    if (geometry === null || !isSurface(geometry)) return null;
    geometry.computeVertexNormals();
    return geometry;
  } catch {
    return null; // its simple shape stands
  }
}

function ofStl(bytes: Uint8Array): BufferGeometry {
  return new STLLoader().parse(bytes.slice().buffer);
}

function isSurface(geometry: BufferGeometry): boolean {
  const corners = geometry.getAttribute("position").array;
  return corners.length >= 9 && corners.every((each) => Number.isFinite(each));
}

function ofObj(bytes: Uint8Array): BufferGeometry | null {
  const found: BufferGeometry[] = [];
  // The loader writes to the console of lines that it does not know: it gets the surface alone.
  const lines = new TextDecoder().decode(bytes).replaceAll(/\\\r?\n/g, " ").split(/\r?\n/);
  const surface = lines.filter((line) => /^\s*(v|vn|vt|f)\s/.test(line)).join("\n");
  new OBJLoader().parse(surface).traverse((each) => {
    if (each instanceof Mesh) found.push(each.geometry as BufferGeometry);
  });
  return merged(found);
}

/** Return one surface of all; only their corners are kept. */
function merged(geometries: readonly BufferGeometry[]): BufferGeometry | null {
  const [only] = geometries;
  if (only === undefined || geometries.length === 1) return only ?? null;
  const arrays = geometries.map((each) => each.toNonIndexed().getAttribute("position").array);
  const all = new Float32Array(arrays.reduce((sum, each) => sum + each.length, 0));
  let at = 0;
  for (const each of arrays) {
    all.set(each, at);
    at += each.length;
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute("position", new BufferAttribute(all, 3));
  return geometry;
}

export function put(object: Object3D, at: Pose): void {
  object.position.set(...at.position);
  object.quaternion.set(...at.quaternion);
}

/** Take everything out of a group, and free what it held. */
export function emptied(group: Object3D): void {
  for (const child of [...group.children]) {
    emptied(child);
    group.remove(child);
    const { geometry, material } = child as Partial<Mesh>;
    geometry?.dispose();
    for (const each of Array.isArray(material) ? material : [material]) each?.dispose();
  }
}
