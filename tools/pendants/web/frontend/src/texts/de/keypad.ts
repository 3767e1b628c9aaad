import type { KeypadTexts } from "../keypad.ts";

export const keypadDe: KeypadTexts = {
  title: "Tastenfeld",
  display: "Anzeige des Tastenfelds",
  what: "Halten Sie eine Taste, und ihre Achse fährt; beim Loslassen steht sie. MODE gehalten: das Menü. Es ist ein eigenes Handgerät, mit den Rechten seiner Brücke: openpendant keypad.",
  key: (label, does) => `Taste ${label}: ${does}`,
  button: "Zustimmungstaste (Übung)",
  holdHow: "Halten Sie diese Taste mit Enter oder dem Zeiger: sie ist nur gedrückt, solange sie gehalten wird.",
  open: "Die Leitung steht. Fehlt die Brücke, sagt es die Anzeige.",
  opening: "Die Leitung wird geöffnet.",
  taken: "Eine andere Seite hat das Tastenfeld. Neuer Versuch folgt.",
  pulled: "Das Kabel ist gezogen, solange dieses Tastenfeld nicht zu sehen ist.",
  lost: "Keine Leitung zum Gateway. Neuer Versuch folgt.",
};
