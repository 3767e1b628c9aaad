// The tasks of the rail, in its order; a task is made when it is first shown.
import { jogTask } from "../panels/jog.ts";
import { teachTask } from "../panels/teach.ts";
import type { MakeTask, Task } from "./app.ts";
import type { IconName } from "./icons.ts";
import { later } from "./later.ts";

export interface TaskEntry {
  task: Task;
  /** Null where the rail has no button for it. */
  icon: IconName | null;
  make: MakeTask;
}

const more = () => import("./more-tasks.ts");

export const TASKS: readonly TaskEntry[] = [
  { task: "jog", icon: "jog", make: jogTask },
  { task: "teach", icon: "teach", make: teachTask },
  { task: "plan", icon: "plan", make: later(async () => (await more()).planTask, { dock: true }) },
  { task: "scene", icon: "scene", make: later(async () => (await more()).sceneTask, {}) },
  { task: "frames", icon: "frames", make: later(async () => (await more()).numbersTask, {}) },
  { task: "plots", icon: "plots", make: later(async () => (await more()).plotsTask, { stage: true }) },
  { task: "packets", icon: "packets", make: later(async () => (await more()).packetsTask, { stage: true }) },
  { task: "tour", icon: null, make: later(async () => (await more()).tourTask, {}) },
];
