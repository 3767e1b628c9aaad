// What the page knows of its gateway: which servers it dials, and how to reach one through it.
import type { LineSocket } from "../keypad/line.ts";
import type { Socket } from "./link.ts";

export interface Served {
  /** Names of the servers that the gateway dials, the first one being the usual. */
  servers: string[];
  /** It has a port for the bridge of a keypad in the page. */
  hasKeypad: boolean;
}

export async function served(): Promise<Served> {
  try {
    const reply = await fetch("./servers");
    const told = (await reply.json()) as { servers?: unknown; keypad?: unknown };
    const listed = Array.isArray(told.servers) ? told.servers : [];
    const servers = listed.map((each: unknown) => nameOf(each)).filter((each) => each !== "");
    return { servers, hasKeypad: told.keypad === true };
  } catch {
    // A page that stands open while its gateway is down still has its one server to try again.
    return { servers: [""], hasKeypad: false };
  }
}

function nameOf(told: unknown): string {
  if (typeof told === "string") return told;
  if (typeof told !== "object" || told === null || !("name" in told)) return "";
  return String(told.name);
}

/** Open a WebSocket to a server of the gateway. */
export function openSocket(server: string): Socket {
  return opened(`./servers/${encodeURIComponent(server)}`) as unknown as Socket;
}

/** Open the line of the keypad in the page. */
export function openKeypadSocket(): LineSocket {
  return opened("./keypad") as unknown as LineSocket;
}

function opened(path: string): WebSocket {
  const url = new URL(path, location.href);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return new WebSocket(url);
}

/** Whether the page came without encryption from another machine. */
export function isFarPlain(): boolean {
  const near = ["localhost", "127.0.0.1", "[::1]"];
  return location.protocol === "http:" && !near.includes(location.hostname);
}
