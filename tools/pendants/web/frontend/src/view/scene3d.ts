// The 3-D view, by three.js: a part of the page of its own, asked for only where there is WebGL.
//
// Draws only when something changed, never a picture before the last one is done (`pace`), and in
// a lower quality where software draws: no shadows, no smoothing, no ghost.
import {
  AmbientLight,
  BufferAttribute,
  BufferGeometry,
  Color,
  DirectionalLight,
  GridHelper,
  Group,
  HemisphereLight,
  MathUtils,
  Mesh,
  PerspectiveCamera,
  PlaneGeometry,
  Points,
  PointsMaterial,
  Raycaster,
  Scene,
  ShadowMaterial,
  Vector2,
  WebGLRenderer,
} from "three";
import { OrbitControls } from "three/addons/controls/OrbitControls.js";
import { Line2 } from "three/addons/lines/Line2.js";
import { LineGeometry } from "three/addons/lines/LineGeometry.js";
import { LineMaterial } from "three/addons/lines/LineMaterial.js";

import { Chain, type RobotDescription } from "../kinematics/chain.ts";
import { eyeOf, FIELD_OF_VIEW, lookingFrom, zoomOf } from "./camera.ts";
import { isSame } from "./changes.ts";
import { ORANGE, PALETTES } from "./colours.ts";
import { Pace } from "./pace.ts";
import { Gizmo3d } from "./gizmo3d.ts";
import { pathDots } from "./path_dots.ts";
import { FrameMarks, SceneSolids } from "./scene_solids.ts";
import { RobotMeshes } from "./robot_meshes.ts";
import { RobotSolids, emptied } from "./robot_solids.ts";
import { EMPTY, type Content, type Gizmo, type MakeView, type Side, type View, type ViewEvents } from "./view.ts";

export type Quality = "full" | "low";

const DOT = 7; // points
const CLICK = 4; // points that a press may move and still picks
const SHADOW_MAP = 2048;
/** From a first picture of a size that was guessed to one of its own [ms]. */
const SHARP_AFTER = 150;
const MOST_RATIO = { full: 2, low: 1 } as const;

/**
 * Return what makes a 3-D view of a quality; throws where the browser gives no WebGL.
 *
 * Its WebGL is begun here, not when the first view is made: by then it would wait until software has
 * drawn all of the page. The context is that which was found already, if there is one.
 */
export function makeScene3d(quality: Quality, context: WebGL2RenderingContext | null): MakeView {
  let begun: WebGLRenderer | null = newRenderer(quality, context);
  return (host, events) => {
    const isRough = begun !== null && context !== null;
    const renderer = begun ?? newRenderer(quality, null);
    begun = null;
    return new Scene3d(host, events, quality, renderer, isRough);
  };
}

function newRenderer(quality: Quality, context: WebGL2RenderingContext | null): WebGLRenderer {
  const found = context === null ? {} : { context, canvas: context.canvas };
  return new WebGLRenderer({ antialias: quality === "full", powerPreference: "low-power", ...found });
}

class Scene3d implements View {
  readonly #host: HTMLElement;
  readonly #events: ViewEvents;
  readonly #quality: Quality;
  readonly #renderer: WebGLRenderer;
  readonly #scene = new Scene();
  readonly #camera = new PerspectiveCamera(MathUtils.radToDeg(FIELD_OF_VIEW), 1, 0.01, 100);
  readonly #controls: OrbitControls;
  readonly #robot: RobotSolids;
  readonly #ghost: RobotSolids;
  readonly #objects = new SceneSolids();
  readonly #frames = new FrameMarks();
  readonly #floor = new Group();
  readonly #trace = way(0.75, 2);
  readonly #path = way(1, 3);
  readonly #dots = new Points(new BufferGeometry(), new PointsMaterial({ size: DOT, sizeAttenuation: false }));
  readonly #sun = new DirectionalLight("#ffffff", 2.4);
  readonly #pace = new Pace();
  readonly #listening = new AbortController();
  #chain: Chain | null = null;
  #content: Content = EMPTY;
  /** Whether the first picture is to come, of the size that its canvas has: then it gets its own. */
  #isRough: boolean;
  #sharpening: ReturnType<typeof setTimeout> | null = null;
  #isSharpDue = false;
  #isWanted = false;
  #isTold = false;
  #frame = 0;
  #fence: WebGLSync | null = null;
  #pressed: Vector2 | null = null;
  /** Made when handles are wanted first: they have many parts. */
  #gizmo: Gizmo3d | null = null;

  constructor(
    host: HTMLElement, events: ViewEvents, quality: Quality, renderer: WebGLRenderer, isRough: boolean,
  ) {
    this.#host = host;
    this.#isRough = isRough;
    this.#events = events;
    this.#quality = quality;
    const isFull = quality === "full";
    this.#renderer = renderer;
    this.#renderer.shadowMap.enabled = isFull;
    const canvas = this.#renderer.domElement;
    Object.assign(canvas.style, { display: "block", touchAction: "none" });
    host.append(canvas);
    this.#camera.up.set(0, 0, 1);
    this.#controls = new OrbitControls(this.#camera, canvas);
    this.#controls.enableDamping = false;
    this.#controls.addEventListener("change", () => this.#want());
    const asks = (): void => this.#want();
    this.#robot = new RobotSolids(isFull, asks);
    this.#ghost = new RobotSolids(isFull, asks);
    this.#build();
    this.#listen(canvas);
    this.look("iso");
    this.resize();
  }

  newMeshes(...around: ConstructorParameters<typeof RobotMeshes>): RobotMeshes {
    return new RobotMeshes(...around);
  }

  show(content: Content): void {
    if (isSame(this.#content, content)) return;
    const before = this.#content;
    this.#content = content;
    if (content.robot !== before.robot) this.#takeRobot(content.robot, before.robot);
    if (content.theme !== before.theme || content.robot !== before.robot) this.#paintGround();
    if (content.trace !== before.trace) setWay(this.#trace, content.trace);
    if (content.path !== before.path) this.#takePath(content.path);
    if (content.meshes !== before.meshes) this.#robot.takeMeshes(content.meshes ?? []);
    this.#objects.show(content.objects, this.#quality === "full");
    this.#frames.show(content.frames, 0.12 * (this.#chain?.size ?? 1), content.theme);
    this.#showGizmo(content.gizmo ?? null);
    this.#placeRobots();
    this.#isWanted = true;
    this.#turn();
  }

  look(side: Side): void {
    const orbit = lookingFrom(side, this.#chain?.size ?? 1);
    this.#camera.position.set(...eyeOf(orbit));
    this.#controls.target.set(...orbit.target);
    this.#controls.update();
    this.#want();
  }

  resize(): void {
    this.#fit();
    this.#want();
  }

  #fit(): void {
    const size = this.#host.getBoundingClientRect();
    const [width, height] = [Math.max(1, size.width), Math.max(1, size.height)];
    const ratio = Math.min(MOST_RATIO[this.#quality], globalThis.devicePixelRatio || 1);
    if (!this.#isRough) this.#renderer.setDrawingBufferSize(width, height, ratio);
    Object.assign(this.#renderer.domElement.style, { width: `${width}px`, height: `${height}px` });
    this.#camera.aspect = width / height;
    this.#camera.zoom = zoomOf(width, height);
    this.#camera.updateProjectionMatrix();
  }

  dispose(): void {
    cancelAnimationFrame(this.#frame);
    if (this.#sharpening !== null) clearTimeout(this.#sharpening);
    this.#listening.abort();
    this.#gizmo?.dispose();
    this.#controls.dispose();
    emptied(this.#scene);
    this.#renderer.dispose();
    this.#renderer.forceContextLoss();
    this.#renderer.domElement.remove();
  }

  #build(): void {
    const sky = new HemisphereLight("#ffffff", "#55606b", this.#quality === "full" ? 1.5 : 1.8);
    this.#scene.add(sky, new AmbientLight("#ffffff", 0.25), this.#sun, this.#sun.target);
    this.#sun.castShadow = this.#quality === "full";
    this.#sun.shadow.mapSize.set(SHADOW_MAP, SHADOW_MAP);
    this.#sun.shadow.bias = -0.0005;
    this.#scene.add(this.#floor, this.#robot.group, this.#ghost.group, this.#objects.group);
    this.#scene.add(this.#frames.group, this.#trace, this.#path, this.#dots);
    this.#dots.visible = false;
    this.#paintGround();
  }

  #takeRobot(robot: RobotDescription | null, before: RobotDescription | null): void {
    this.#chain = robot === null ? null : new Chain(robot);
    this.#robot.takeRobot(this.#chain);
    this.#robot.takeMeshes(this.#content.meshes ?? []);
    this.#ghost.takeRobot(this.#quality === "full" ? this.#chain : null);
    const size = this.#chain?.size ?? 1;
    this.#sun.position.set(0.9 * size, -1.3 * size, 2.2 * size);
    const shadow = this.#sun.shadow.camera;
    Object.assign(shadow, { left: -1.6 * size, right: 1.6 * size, top: 1.6 * size });
    Object.assign(shadow, { bottom: -1.6 * size, near: 0.1 * size, far: 6 * size });
    shadow.updateProjectionMatrix();
    this.#camera.near = size / 100;
    this.#camera.far = size * 60;
    this.#camera.updateProjectionMatrix();
    this.#controls.minDistance = 0.1 * size;
    this.#controls.maxDistance = 20 * size;
    if (robot?.hash !== before?.hash) this.look("iso");
  }

  #takePath(path: Float32Array): void {
    setWay(this.#path, path);
    this.#dots.geometry.dispose();
    this.#dots.geometry = new BufferGeometry().setAttribute("position", new BufferAttribute(pathDots(path), 3));
    this.#dots.visible = path.length > 0;
    this.#dots.frustumCulled = false;
  }

  #showGizmo(gizmo: Gizmo | null): void {
    if (gizmo !== null && this.#gizmo === null) {
      const canvas = this.#renderer.domElement;
      this.#gizmo = new Gizmo3d(this.#camera, canvas, this.#controls, this.#events, () => this.#want());
      this.#scene.add(this.#gizmo.helper);
    }
    this.#gizmo?.show(gizmo);
  }

  #placeRobots(): void {
    const { joints, stale, driven, ghost, theme } = this.#content;
    const isOld = stale || joints === null;
    this.#robot.pose(joints, isOld ? { all: PALETTES[theme].stale } : { driven });
    this.#ghost.group.visible = ghost !== null;
    if (ghost !== null) this.#ghost.pose(ghost.joints, { ghost: ghost.verdict }, { joints });
  }

  #paintGround(): void {
    const { ground, grid, ink } = PALETTES[this.#content.theme];
    this.#dots.material.color.set(ink);
    this.#scene.background = new Color(ground[1]).lerp(new Color(ground[0]), 0.35);
    emptied(this.#floor);
    const size = this.#chain?.size ?? 1;
    const lines = new GridHelper(4.4 * size, 18, grid, grid);
    lines.rotation.x = Math.PI / 2;
    this.#floor.add(lines);
    this.#floor.position.z = (this.#chain?.root.position[2] ?? 0) - 0.002 * size;
    if (this.#quality === "low") return;
    const dark = new ShadowMaterial({ opacity: this.#content.theme === "dark" ? 0.4 : 0.18 });
    const plane = new Mesh(new PlaneGeometry(6 * size, 6 * size), dark);
    plane.receiveShadow = true;
    this.#floor.add(plane);
  }

  #want(): void {
    if (this.#content === EMPTY) return; // a picture of nothing would hold up the first one
    this.#isWanted = true;
    if (this.#frame === 0) this.#frame = requestAnimationFrame(() => this.#turn());
  }

  /** Draw if it is wanted and the last picture is done; else look again with the next frame. */
  #turn(): void {
    cancelAnimationFrame(this.#frame);
    this.#frame = 0;
    const now = performance.now();
    if (this.#isDone()) this.#ended(now);
    if (this.#listening.signal.aborted) return; // it was too slow, and is another view's turn
    if (this.#isWanted && this.#pace.mayDraw(now)) this.#draw(now);
    if (this.#isWanted || this.#pace.isDrawing) {
      this.#frame = requestAnimationFrame(() => this.#turn());
    }
  }

  #draw(now: number): void {
    this.#isWanted = false;
    if (this.#isSharpDue) {
      // Here no picture is under way, for which another size would wait, and one follows at once.
      this.#isSharpDue = this.#isRough = false;
      this.#fit();
    }
    this.#pace.began(now);
    this.#frames.face(this.#camera);
    this.#renderer.render(this.#scene, this.#camera);
    const gl = this.#renderer.getContext() as WebGL2RenderingContext;
    this.#fence = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
  }

  #isDone(): boolean {
    if (!this.#pace.isDrawing) return false;
    const gl = this.#renderer.getContext() as WebGL2RenderingContext;
    if (this.#fence === null || gl.isContextLost()) return true;
    if (gl.getSyncParameter(this.#fence, gl.SYNC_STATUS) !== gl.SIGNALED) return false;
    gl.deleteSync(this.#fence);
    this.#fence = null;
    return true;
  }

  #sharpen(): void {
    this.#isSharpDue = true;
    this.#want();
  }

  #ended(now: number): void {
    this.#pace.ended(now);
    if (this.#chain !== null) this.#renderer.domElement.dataset["showsRobot"] = "";
    if (this.#isRough) this.#sharpening ??= setTimeout(() => this.#sharpen(), SHARP_AFTER);
    if (!this.#pace.isTooSlow || this.#isTold) return;
    this.#isTold = true;
    this.#events.tooSlow?.();
  }

  #listen(canvas: HTMLCanvasElement): void {
    const { signal } = this.#listening;
    canvas.addEventListener("webglcontextlost", (event) => {
      event.preventDefault();
      this.#events.tooSlow?.();
    }, { signal });
    canvas.addEventListener("pointerdown", (event) => {
      this.#pressed = new Vector2(event.clientX, event.clientY);
    }, { signal });
    canvas.addEventListener("pointerup", (event) => {
      const from = this.#pressed;
      this.#pressed = null;
      if (from === null || this.#gizmo?.isDragging === true) return;
      if (from.distanceTo(new Vector2(event.clientX, event.clientY)) > CLICK) return;
      this.#events.picked(this.#objectAt(event));
    }, { signal });
  }

  #objectAt(event: PointerEvent): string | null {
    const { left, top, width, height } = this.#renderer.domElement.getBoundingClientRect();
    const at = new Vector2(
      (2 * (event.clientX - left)) / width - 1,
      1 - (2 * (event.clientY - top)) / height,
    );
    const ray = new Raycaster();
    ray.setFromCamera(at, this.#camera);
    const [hit] = ray.intersectObjects([...this.#objects.pickable], false);
    return hit === undefined ? null : hit.object.name;
  }
}

function way(opacity: number, linewidth: number): Line2 {
  const material = new LineMaterial({ color: ORANGE, transparent: true, opacity, linewidth });
  const line = new Line2(new LineGeometry(), material);
  line.visible = false;
  line.frustumCulled = false;
  return line;
}

/** Show a way of points x, y, z. Its last part alone is shown where a point is not finite. */
function setWay(line: Line2, points: Float32Array): void {
  const gap = points.findLastIndex((each) => !Number.isFinite(each));
  const from = gap < 0 ? 0 : 3 * (Math.floor(gap / 3) + 1);
  line.visible = points.length - from >= 6;
  if (!line.visible) return;
  line.geometry.dispose();
  line.geometry = new LineGeometry();
  line.geometry.setPositions(points.subarray(from));
}
