// The words of meshes that are not shown, in each language.
import type { Language } from "./texts.ts";

export const meshesMissing: Readonly<Record<Language, (count: number) => string>> = {
  en: (count) => `${count} of the robot's meshes did not come whole: its simple shapes stand there.`,
  de: (count) =>
    `${count} Netze des Roboters kamen nicht vollständig: dort stehen seine einfachen Formen.`,
};
