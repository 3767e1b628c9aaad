// The tasks of the rail, in its order; a task is made when it is first shown.
import { jogTask } from "../panels/jog.ts";
import { keypadTask } from "../panels/keypad.ts";
import { logTask } from "../panels/log.ts";
import { numbersTask } from "../panels/numbers.ts";
import { packetsTask } from "../panels/packets.ts";
import { planTask } from "../panels/plan.ts";
import { plotsTask } from "../panels/plots.ts";
import { sceneTask } from "../panels/scene.ts";
import { teachTask } from "../panels/teach.ts";
import { tourTask } from "../tour/panel.ts";
import type { MakeTask, Task } from "./app.ts";
import type { IconName } from "./icons.ts";

export interface TaskEntry {
  task: Task;
  /** Null where the rail has no button for it. */
  icon: IconName | null;
  make: MakeTask;
  /** Whether it shows each message that comes, also of a robot that stands. */
  isLive?: true;
}

export const TASKS: readonly TaskEntry[] = [
  { task: "jog", icon: "jog", make: jogTask },
  { task: "teach", icon: "teach", make: teachTask },
  { task: "plan", icon: "plan", make: planTask },
  { task: "scene", icon: "scene", make: sceneTask },
  { task: "frames", icon: "frames", make: numbersTask },
  { task: "plots", icon: "plots", make: plotsTask, isLive: true },
  { task: "packets", icon: "packets", make: packetsTask, isLive: true },
  { task: "log", icon: "log", make: logTask },
  { task: "keypad", icon: "keypad", make: keypadTask },
  { task: "tour", icon: null, make: tourTask },
];
