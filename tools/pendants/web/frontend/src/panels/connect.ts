// Connect: which server, by what name, and what shows who it is.
import type { App, Part } from "../ui/app.ts";
import { h, say, show } from "../ui/elements.ts";
import { isFarPlain } from "../wire/gateway.ts";
import type { Credentials } from "../wire/session.ts";

export function connectDialog(app: App, servers: readonly string[]): Part {
  const { texts, session } = app;
  const server = h("select", {}, ...servers.map((each) => h("option", { value: each }, each)));
  const name = h("input", { type: "text", maxlength: 32, autocomplete: "username" });
  const secret = h("input", { type: "password", maxlength: 128, autocomplete: "current-password" });
  const secretName = h("span", {}, texts.password);
  let kind: Credentials["kind"] = "password";
  const byPassword = h("button", { type: "button" }, texts.byPassword);
  const byCode = h("button", { type: "button" }, texts.byCode);
  const choose = (wanted: Credentials["kind"]): void => {
    kind = wanted;
    byPassword.setAttribute("aria-pressed", String(kind === "password"));
    byCode.setAttribute("aria-pressed", String(kind === "pairing"));
    byPassword.classList.toggle("chosen", kind === "password");
    byCode.classList.toggle("chosen", kind === "pairing");
    say(secretName, kind === "password" ? texts.password : texts.pairingCode);
    secret.type = kind === "password" ? "password" : "text";
  };
  byPassword.addEventListener("click", () => choose("password"));
  byCode.addEventListener("click", () => choose("pairing"));
  choose("password");
  const warning = h("p", { class: "warning" }, texts.plainHttp);
  show(warning, isFarPlain());
  const close = (): void => app.choice.set({ isConnectOpen: false });
  const form = h(
    "form",
    {},
    h("h2", {}, texts.connectTitle),
    servers.length > 1 ? h("label", {}, h("span", {}, texts.server), server) : null,
    h("label", {}, h("span", {}, texts.yourName), name, h("small", {}, texts.yourNameHint)),
    h("div", { class: "tabs", role: "group" }, byPassword, byCode),
    h("label", {}, secretName, secret),
    warning,
    h(
      "div",
      { class: "acts" },
      h("button", { type: "button", class: "quiet", onclick: close }, texts.cancel),
      h("button", { type: "button", onclick: () => { session.leave(); go(app, server.value, name.value, null); close(); } }, texts.lookOn),
      h("button", { type: "submit", class: "orange" }, texts.logIn),
    ),
  );
  form.addEventListener("submit", (event) => {
    event.preventDefault();
    const credentials = secret.value === "" ? null : { kind, name: name.value, secret: secret.value };
    secret.value = "";
    close();
    if (credentials !== null && app.cell.value.stage === "up") {
      session.identify(name.value, credentials);
      app.attempt(() => session.login(credentials));
    } else go(app, server.value, name.value, credentials);
  });
  const element = h("div", { class: "veil", role: "dialog", "aria-modal": "false", "aria-label": texts.connectTitle }, form);
  let wasOpen = false;
  return {
    element,
    update() {
      const isOpen = app.choice.value.isConnectOpen;
      show(element, isOpen);
      if (isOpen && !wasOpen) name.focus();
      wasOpen = isOpen;
    },
  };
}

function go(app: App, server: string, name: string, credentials: Credentials | null): void {
  const { session } = app;
  session.identify(name, credentials);
  const place = session.place;
  if (place !== null && place.cell !== "" && place.server === server) session.enter(place);
  else session.visit(server);
}
