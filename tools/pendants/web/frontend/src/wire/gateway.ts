// What the page knows of its gateway: which servers it dials, and how to reach one through it.
import type { Socket } from "./link.ts";

/** Return the names of the servers that the gateway dials, the first one being the usual. */
export async function servedServers(): Promise<string[]> {
  try {
    const reply = await fetch("./servers");
    const told = (await reply.json()) as { servers?: unknown };
    const listed = Array.isArray(told.servers) ? told.servers : [];
    return listed.map((each: unknown) => nameOf(each)).filter((each) => each !== "");
  } catch {
    // A page that stands open while its gateway is down still has its one server to try again.
    return [""];
  }
}

function nameOf(told: unknown): string {
  if (typeof told === "string") return told;
  if (typeof told !== "object" || told === null || !("name" in told)) return "";
  return String(told.name);
}

/** Open a WebSocket to a server of the gateway. */
export function openSocket(server: string): Socket {
  const url = new URL(`./servers/${encodeURIComponent(server)}`, location.href);
  url.protocol = url.protocol === "https:" ? "wss:" : "ws:";
  return new WebSocket(url) as unknown as Socket;
}

/** Whether the page came without encryption from another machine. */
export function isFarPlain(): boolean {
  const near = ["localhost", "127.0.0.1", "[::1]"];
  return location.protocol === "http:" && !near.includes(location.hostname);
}
