// The words of the keypad in the page, in English; what stands on its display comes from its bridge.

export const keypadEn = {
  title: "Keypad pendant",
  display: "Display of the keypad",
  what: "Hold a key and its joint moves; let go and it stands. MODE held: the menu. It is a pendant of its own, with the rights of its bridge: openpendant keypad.",
  key: (label: string, does: string) => `Key ${label}: ${does}`,
  button: "Enabling button (training)",
  holdHow: "Hold this key with Enter or the pointer: it is down only as long as it is held.",
  open: "The line is open. Without a bridge the display says so.",
  opening: "The line is being opened.",
  taken: "Another page has the keypad. Trying again.",
  pulled: "The cable is pulled while this keypad is not shown.",
  lost: "No line to the gateway. Trying again.",
};

export type KeypadTexts = typeof keypadEn;
