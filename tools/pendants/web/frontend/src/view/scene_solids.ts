// The scene's objects and the frames in three.js.
import {
  CanvasTexture,
  Color,
  EdgesGeometry,
  Group,
  LineBasicMaterial,
  LineDashedMaterial,
  LineSegments,
  Mesh,
  Sprite,
  SpriteMaterial,
  type BufferGeometry,
  type Camera,
} from "three";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";
import { LineSegments2 } from "three/addons/lines/LineSegments2.js";
import { LineSegmentsGeometry } from "three/addons/lines/LineSegmentsGeometry.js";

import { AXES, GREEN, ORANGE, PALETTES, type Theme } from "./colours.ts";
import { emptied, put, solidGeometry, solidMaterial } from "./robot_solids.ts";
import type { SolidMaterial } from "./robot_solids.ts";
import type { FrameMark, SceneObject } from "./view.ts";

const UNITS = [[1, 0, 0], [0, 1, 0], [0, 0, 1]] as const;
const LABEL_HEIGHT = 0.045; // of the distance, so that names stay as large as they are

export class SceneSolids {
  readonly group = new Group();
  #shown: readonly SceneObject[] = [];
  #pickable: Mesh[] = [];

  /** What can be pressed; each has the name of its object. */
  get pickable(): readonly Mesh[] {
    return this.#pickable;
  }

  show(objects: readonly SceneObject[], castsShadows: boolean): void {
    if (objects === this.#shown) return;
    this.#shown = objects;
    emptied(this.group);
    this.#pickable = [];
    for (const object of objects) {
      const geometry = solidGeometry(object.shape, castsShadows);
      const body = new Mesh(geometry, bodyMaterial(object, castsShadows));
      body.castShadow = castsShadows && !isSeeThrough(object);
      body.receiveShadow = body.castShadow;
      body.name = object.name;
      put(body, object);
      body.add(edges(object, geometry));
      this.group.add(body);
      if (object.shadow !== true) this.#pickable.push(body);
    }
  }
}

function isSeeThrough(object: SceneObject): boolean {
  return object.keepOut || object.shadow === true;
}

function bodyMaterial(object: SceneObject, isFine: boolean): SolidMaterial {
  const clear = isSeeThrough(object);
  const opacity = object.shadow === true ? 0.12 : object.keepOut ? 0.18 : 1;
  const paint = { color: new Color(object.shape.colour), roughness: 0.8, opacity };
  return solidMaterial({ ...paint, transparent: clear, depthWrite: !clear }, isFine);
}

function edges(object: SceneObject, geometry: BufferGeometry): LineSegments {
  const outline = new EdgesGeometry(geometry, 30);
  const color = object.chosen ? ORANGE : object.held ? GREEN : object.shape.colour;
  if (object.shadow !== true) return new LineSegments(outline, new LineBasicMaterial({ color }));
  const dashes = new LineDashedMaterial({ color, dashSize: 0.03, gapSize: 0.02 });
  return new LineSegments(outline, dashes).computeLineDistances();
}

export class FrameMarks {
  readonly group = new Group();
  #shown: readonly FrameMark[] = [];
  #theme: Theme | null = null;
  #length = 0;
  #axes: LineSegments2[] = [];
  /** Null for a frame without a name. */
  #labels: (Sprite | null)[] = [];

  show(frames: readonly FrameMark[], length: number, theme: Theme): void {
    if (frames === this.#shown && theme === this.#theme) return;
    const areSame = theme === this.#theme && length === this.#length && haveSameNames(frames, this.#shown);
    this.#shown = frames;
    if (areSame) return frames.forEach((mark, index) => this.#put(mark, index));
    this.#theme = theme;
    this.#length = length;
    for (const label of this.#labels) label?.material.map?.dispose();
    emptied(this.group);
    this.#axes = frames.map(() => threeAxes(length));
    this.#labels = frames.map(({ name }) => labelled(name, theme));
    for (const each of [...this.#axes, ...this.#labels]) if (each !== null) this.group.add(each);
    frames.forEach((mark, index) => this.#put(mark, index));
  }

  #put(mark: FrameMark, index: number): void {
    const axes = this.#axes[index];
    if (axes !== undefined) put(axes, mark);
    this.#labels[index]?.position.set(...mark.position);
  }

  /** Keep the names as large as they are, wherever the camera is. */
  face(camera: Camera): void {
    for (const label of this.#labels) {
      if (label === null) continue;
      const height = LABEL_HEIGHT * label.position.distanceTo(camera.position);
      label.scale.set(height * (label.userData["aspect"] as number), height, 1);
    }
  }
}

function haveSameNames(one: readonly FrameMark[], other: readonly FrameMark[]): boolean {
  return one.length === other.length && one.every(({ name }, index) => name === other[index]?.name);
}

function threeAxes(length: number): LineSegments2 {
  const geometry = new LineSegmentsGeometry();
  geometry.setPositions([0, 1, 2].flatMap((axis) => [0, 0, 0, ...UNITS[axis]!.map((each) => each * length)]));
  geometry.setColors(AXES.flatMap((each) => [...new Color(each).toArray(), ...new Color(each).toArray()]));
  return new LineSegments2(geometry, new LineMaterial({ vertexColors: true, linewidth: 3 }));
}

function labelled(name: string, theme: Theme): Sprite | null {
  const canvas = document.createElement("canvas");
  const paper = canvas.getContext("2d");
  if (name === "" || paper === null) return null;
  const font = "26px system-ui, sans-serif";
  paper.font = font;
  canvas.width = Math.ceil(paper.measureText(name).width) + 20;
  canvas.height = 40;
  paper.font = font;
  paper.textBaseline = "middle";
  paper.fillStyle = PALETTES[theme].chip;
  paper.fillRect(0, 0, canvas.width, canvas.height);
  paper.fillStyle = PALETTES[theme].ink;
  paper.fillText(name, 10, 21);
  const map = new CanvasTexture(canvas);
  const label = new Sprite(new SpriteMaterial({ map, depthTest: false, transparent: true }));
  label.center.set(-0.08, 1.15);
  label.userData["aspect"] = canvas.width / canvas.height;
  return label;
}
