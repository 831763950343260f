// Marks of inputs on the time line of a recording.
import { element } from "./panels.ts";
import type { MarksText, Run } from "./protocol.ts";

/** A click on a mark goes to its tick. */
export function showMarks(marks: MarksText["marks"], run: Run, seek: (tick: number) => void): void {
  const box = element("marks");
  const span = Math.max(1, run.lastTick - run.firstTick);
  box.replaceChildren(...marks.map(({ tick, text }) => {
    const mark = document.createElement("span");
    const part = Math.min(1, Math.max(0, (tick - run.firstTick) / span));
    // The thumb of the line is 16 px wide and stays within it.
    mark.style.left = `calc(8px + (100% - 16px) * ${part.toFixed(5)})`;
    mark.title = `${(tick * run.tickSeconds).toFixed(2)} s: ${text}`;
    mark.addEventListener("click", () => seek(tick));
    return mark;
  }));
  box.setAttribute("aria-label", marks.length === 0 ? "" : `Marks: ${marks.length} robots or objects placed elsewhere`);
}
