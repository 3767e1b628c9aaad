// What may become of a request besides its reply.
import type { Outcome, Verdict } from "../protocol.ts";

/** The numbers of a refusal or an abort; its sentence is made from them in the person's language. */
export interface Refusal {
  code: number;
  joint: number;
  value: number;
  limit: number;
  text: string;
}

/** The server refused a request, or ended a motion before its goal. */
export class Refused extends Error {
  readonly refusal: Refusal;

  constructor(refusal: Refusal) {
    super(refusal.text);
    this.name = "Refused";
    this.refusal = refusal;
  }
}

/** The link ended before the answer came. */
export class LinkLost extends Error {
  constructor() {
    super("the link ended");
    this.name = "LinkLost";
  }
}

export function refusalOf(told: Verdict | Outcome): Refusal {
  const { code, joint, value, limit, text } = told;
  return { code, joint, value, limit, text };
}

/** Of a request that the server does not know. */
export function unknownRequest(type: string): Refusal {
  return { code: 41, joint: -1, value: 0, limit: 0, text: `the server does not know ${type}` };
}
