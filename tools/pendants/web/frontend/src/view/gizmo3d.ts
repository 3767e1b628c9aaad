// Handles of the 3-D view that drag the tool's target or an object; they tell, and move nothing.
import { Object3D, type Camera } from "three";
import type { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { TransformControls } from "three/addons/controls/TransformControls.js";

import { pose, vector3, type Pose } from "../kinematics/pose.ts";
import { put } from "./robot_solids.ts";
import type { Gizmo, ViewEvents } from "./view.ts";

const MODES = { place: "translate", turn: "rotate", size: "scale" } as const;
const LEAST_SCALE = 0.01;

export class Gizmo3d {
  readonly #dragged = new Object3D();
  readonly #controls: TransformControls;
  readonly #events: ViewEvents;
  #gizmo: Gizmo | null = null;

  constructor(
    camera: Camera,
    canvas: HTMLElement,
    orbit: OrbitControls,
    events: ViewEvents,
    asks: () => void,
  ) {
    this.#events = events;
    this.#controls = new TransformControls(camera, canvas);
    this.#controls.setSize(0.9);
    this.#controls.addEventListener("change", asks);
    this.#controls.addEventListener("objectChange", () => this.#tell(false));
    this.#controls.addEventListener("dragging-changed", (event) => {
      const isDragging = event.value === true;
      orbit.enabled = !isDragging;
      if (!isDragging) this.#tell(true);
    });
  }

  /** What is to be put into the scene. */
  get helper(): Object3D {
    return this.#controls.getHelper();
  }

  get isDragging(): boolean {
    return this.#controls.dragging;
  }

  show(gizmo: Gizmo | null): void {
    if (gizmo === this.#gizmo) return;
    // What is dragged stays under the pointer, whatever comes meanwhile.
    const isSameOne = gizmo !== null && gizmo.object === this.#gizmo?.object;
    this.#gizmo = gizmo;
    if (gizmo === null) {
      this.#controls.detach();
      this.#dragged.removeFromParent();
      return;
    }
    if (!(isSameOne && this.isDragging)) {
      put(this.#dragged, gizmo.pose);
      this.#dragged.scale.setScalar(1);
    }
    this.#dragged.updateMatrixWorld();
    this.#controls.setMode(MODES[gizmo.drags]);
    this.#controls.setSpace(gizmo.drags === "place" ? "world" : "local");
    this.#controls.setTranslationSnap(gizmo.snap > 0 ? gizmo.snap : null);
    if (this.#controls.object === this.#dragged) return;
    this.helper.parent?.add(this.#dragged);
    this.#controls.attach(this.#dragged);
  }

  dispose(): void {
    this.#controls.detach();
    this.#controls.dispose();
  }

  #tell(isDone: boolean): void {
    if (this.#gizmo === null) return;
    const { object, drags } = this.#gizmo;
    if (object !== null && drags === "size") {
      const by = vector3(this.#dragged.scale.toArray().map((each) => Math.max(LEAST_SCALE, Math.abs(each))));
      this.#events.objectScaled(object, by, isDone);
      return;
    }
    const at: Pose = pose(this.#dragged.position.toArray(), this.#dragged.quaternion.toArray());
    if (object === null) this.#events.gizmoMoved(at, isDone);
    else this.#events.objectMoved(object, at, isDone);
  }
}
