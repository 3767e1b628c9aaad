// The frame of every screen: top row, rail, banner over the picture, panel and dock of the task.
import { banner } from "../panels/banner.ts";
import { cellView } from "../panels/cell-view.ts";
import type { CellView } from "../panels/cell-view.ts";
import { checklistCard } from "../panels/checklist.ts";
import { connectDialog } from "../panels/connect.ts";
import { enablingQuestion, stopDock } from "../panels/dock.ts";
import { lobby } from "../panels/lobby.ts";
import { menu } from "../panels/menu.ts";
import { topRow } from "../panels/top-row.ts";
import type { Cell } from "../pendant/cell.ts";
import { pageState } from "../pendant/states.ts";
import type { App, Part, Task, TaskPart } from "./app.ts";
import { attribute, h, mark, show } from "./elements.ts";
import { icon } from "./icons.ts";
import { TASKS } from "./tasks.ts";
import type { Served } from "../wire/gateway.ts";

export interface Layout extends Part {
  readonly view: CellView;
  /** Leave the task that is shown, and give back what the view holds. */
  close(): void;
}

export function layout(app: App, { servers, hasKeypad }: Served): Layout {
  const checklist = checklistCard(app);
  const view = cellView(app, checklist.element);
  const top = topRow(app);
  const state = banner(app);
  const question = enablingQuestion(app);
  const stop = stopDock(app);
  const cells = lobby(app);
  const dialogs = [connectDialog(app, servers), menu(app)];
  const parts: Part[] = [top, state, view, checklist, question, stop, cells, ...dialogs];
  const panel = h("aside", { class: "panel" });
  const taskDock = h("div", { class: "task-dock" });
  const taskStage = h("div", { class: "task-stage" });
  const dock = h("div", { class: "dock" }, question.element, stop.element, taskDock);
  const made = new Map<Task, TaskPart>();
  const rail = h(
    "nav",
    { class: "rail", "aria-label": app.texts.tasks },
    ...TASKS.map(({ task, icon: drawn }) =>
      drawn !== null && (hasKeypad || task !== "keypad") &&
      h("button", { type: "button", "data-task": task, onclick: () => app.choice.set({ task }) },
        icon(drawn), h("span", {}, app.texts[task])),
    ),
  );
  const work = h("main", { class: "work" }, rail, h("div", { class: "stage" }, state.element, view.element, taskStage), panel, dock);
  const element = h("div", { class: "frame" }, top.element, work, cells.element, ...dialogs.map((each) => each.element));
  let shownTask: Task | null = null;
  const chosen = (): TaskPart | undefined => {
    const { task } = app.choice.value;
    const entry = TASKS.find((each) => each.task === task) ?? TASKS[0];
    if (entry === undefined) return undefined;
    let part = made.get(entry.task);
    if (part === undefined) {
      part = entry.make(app);
      made.set(entry.task, part);
    }
    if (shownTask !== entry.task) {
      if (shownTask !== null) made.get(shownTask)?.shown?.(false);
      shownTask = entry.task;
      panel.replaceChildren(part.element);
      taskDock.replaceChildren(...(part.dock === undefined ? [] : [part.dock]));
      taskStage.replaceChildren(...(part.stage === undefined ? [] : [part.stage]));
      show(taskStage, part.stage !== undefined);
      show(view.element, part.stage === undefined);
      part.shown?.(true);
    }
    return part;
  };
  return {
    element,
    view,
    close() {
      if (shownTask !== null) made.get(shownTask)?.shown?.(false);
      view.close();
    },
    update(cell: Cell) {
      const part = chosen();
      const where = pageState(cell);
      attribute(element, "data-state", where);
      show(work, cell.stage !== "lobby");
      for (const each of parts) each.update(cell);
      part?.update(cell);
      // Marked here, not asked for by `:has()`, which styles every button anew as often as a text changes.
      mark(work, "teaching", shownTask === "teach");
      mark(work, "planning", shownTask === "plan" && part?.dock?.hidden === false);
      mark(work, "listed", !checklist.element.hidden);
      // One question at a time: what the task has to say waits for it.
      show(taskDock, !!(part?.dock && question.element.hidden && stop.element.hidden));
      show(dock, [question.element, stop.element, taskDock].some((each) => !each.hidden));
      for (const button of rail.querySelectorAll("button")) {
        const isChosen = button.dataset["task"] === shownTask;
        mark(button, "chosen", isChosen);
        attribute(button, "aria-current", isChosen ? "page" : null);
      }
    },
  };
}
