// The tasks that are fetched when the first of them is shown: the first picture does not wait for them.
export { numbersTask } from "../panels/numbers.ts";
export { packetsTask } from "../panels/packets.ts";
export { planTask } from "../panels/plan.ts";
export { plotsTask } from "../panels/plots.ts";
export { sceneTask } from "../panels/scene.ts";
export { tourTask } from "../tour/panel.ts";
