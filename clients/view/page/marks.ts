// Marks of inputs on the time line of a recording.
import { element } from "./panels.ts";
import type { MarksText, Run } from "./protocol.ts";

function markOf(words: string, act: () => void): HTMLElement {
  const mark = document.createElement("button");
  mark.type = "button";
  mark.title = words;
  mark.setAttribute("aria-label", `Go to ${words}`);
  mark.addEventListener("click", act);
  return mark;
}

/** A mark is a button that goes to its tick. Those that are there already stay, with the focus that one may have. */
export function showMarks(marks: MarksText["marks"], run: Run, seek: (tick: number) => void): void {
  const box = element("marks");
  const span = Math.max(1, run.lastTick - run.firstTick);
  marks.forEach(({ tick, text }, i) => {
    const words = `${(tick * run.tickSeconds).toFixed(2)} s: ${text}`;
    let mark = box.children[i] as HTMLElement | undefined;
    if (mark?.title !== words) {
      const fresh = markOf(words, () => seek(tick));
      if (mark) mark.replaceWith(fresh);
      else box.append(fresh);
      mark = fresh;
    }
    // The thumb of the line is 16 px wide and stays within it.
    const part = Math.min(1, Math.max(0, (tick - run.firstTick) / span));
    mark.style.left = `calc(8px + (100% - 16px) * ${part.toFixed(5)})`;
  });
  while (box.children.length > marks.length) box.lastElementChild!.remove();
  box.setAttribute("aria-label", marks.length === 0 ? "" : `Marks: ${marks.length} robots or objects placed elsewhere`);
}
