// The lobby: the cells of a server, to choose one.
import type { ServedCell } from "../protocol.ts";
import type { App, Part } from "../ui/app.ts";
import { h, mark, show } from "../ui/elements.ts";
import { icon } from "../ui/icons.ts";

export function lobby(app: App): Part {
  const { texts } = app;
  const find = h("input", { type: "search", placeholder: texts.findCell, "aria-label": texts.findCell });
  const count = h("span", { class: "count" });
  const grid = h("div", { class: "cells" });
  const element = h(
    "main",
    { class: "lobby" },
    h("header", {}, h("div", {}, h("h1", {}, texts.chooseCell), h("p", {}, texts.chooseCellHint)), count, find),
    grid,
  );
  let told: readonly ServedCell[] | null = null;
  const fill = (): void => {
    const wanted = find.value.trim().toLowerCase();
    const cells = (told ?? []).filter((each) =>
      `${each.cell} ${each.display ?? ""} ${each.robot}`.toLowerCase().includes(wanted),
    );
    const first = cells.find((each) => each.emulated === true && (each.holder ?? "") === "");
    const none = (told ?? []).length === 0 ? texts.noCells : texts.noneFound;
    grid.replaceChildren(...cells.map((each) => card(app, each, each === first)));
    if (cells.length === 0) grid.append(h("p", {}, none));
  };
  find.addEventListener("input", fill);
  return {
    element,
    update(cell) {
      const isOpen = cell.stage === "lobby";
      show(element, isOpen);
      // What is the same as before keeps its buttons, and one that asks again goes on asking.
      const isSame = JSON.stringify(cell.cells) === JSON.stringify(told);
      if (!isOpen || (isSame && grid.childElementCount > 0)) return;
      told = cell.cells;
      count.textContent = texts.cellsOf(told?.length ?? 0);
      fill();
    },
  };
}

function card(app: App, served: ServedCell, isWanted: boolean): HTMLElement {
  const { texts } = app;
  const isEmulated = served.emulated === true;
  const holder = served.holder ?? "";
  const [tone, word] = !isEmulated
    ? ["real", texts.realRobot]
    : served.holder === undefined
      ? ["plain", texts.loginNeeded]
      : holder !== ""
        ? ["busy", served.moving === true ? texts.moving : texts.inUse]
        : ["good", texts.free];
  const enter = h("button", { type: "button" });
  const plain = holder !== "" ? texts.watch : isEmulated ? texts.enter : texts.enterReal;
  enter.textContent = plain;
  enter.setAttribute("aria-label", `${plain} ${served.cell}`);
  enter.addEventListener("click", () => {
    if (!isEmulated && enter.textContent !== texts.enterRealAgain) {
      enter.textContent = texts.enterRealAgain;
      return;
    }
    app.session.enter({ server: app.session.place?.server ?? "", cell: served.cell });
  });
  mark(enter, "orange", isWanted);
  const element = h(
    "article",
    { class: "cell" },
    h("span", { class: "state", "data-tone": tone }, isEmulated ? h("i", {}) : icon("warning"), word),
    h("div", { class: "picture" }, icon("robot")),
    h(
      "div",
      { class: "foot" },
      h("div", {}, h("h2", {}, served.cell, h("small", {}, served.display ?? served.robot)),
        h("p", {}, holder === "" ? texts.nobodyInControl : texts.inControl(holder))),
      enter,
    ),
  );
  mark(element, "wanted", isWanted);
  mark(element, "real", !isEmulated);
  return element;
}
