// Dark and light: the system's choice until the viewer chooses.
import type { Colour } from "./geometry.ts";
import type { Palette } from "./renderer.ts";

const KEY = "kilotwin-theme";
const dark = window.matchMedia("(prefers-color-scheme: dark)");

function parse(text: string): Colour {
  const value = Number.parseInt(text.trim().slice(1), 16);
  return [(value >> 16) & 255, (value >> 8) & 255, value & 255, 255];
}

export class Theme {
  palette!: Palette;
  readonly #changed: () => void;

  constructor(changed: () => void) {
    this.#changed = changed;
    dark.addEventListener("change", () => this.#apply());
    this.#apply();
  }

  toggle(): void {
    localStorage.setItem(KEY, this.#name() === "dark" ? "light" : "dark");
    this.#apply();
  }

  #name(): string {
    return localStorage.getItem(KEY) ?? (dark.matches ? "dark" : "light");
  }

  #apply(): void {
    document.documentElement.dataset["theme"] = this.#name();
    const style = getComputedStyle(document.documentElement);
    const colour = (name: string): Colour => parse(style.getPropertyValue(`--${name}`));
    this.palette = {
      background: colour("background"), floor: colour("floor"), grid: colour("grid"), wall: colour("wall"),
      obstacle: colour("obstacle"), movable: colour("movable"), movableRim: colour("movable-rim"), lamp: colour("lamp"),
      ink: colour("ink"), body: colour("body"), fault: colour("fault"), tracked: colour("tracked"), accent: colour("accent"),
      message: colour("message"), ghost: colour("ghost"),
    };
    this.#changed();
  }
}
