// Where the time of the federates goes: who computes, who waits, and who holds up the others.
import { element, setText } from "./panels.ts";
import type { FederateWork, WorkText } from "./protocol.ts";

/** A federate that waits for less than this share of its time never stands still for the others. */
const IDLE_SHARE = 0.5;

const total = (one: FederateWork): number => one.step + one.exchange + one.wait;
const whole = (part: number): string => String(Math.round(100 * part));
const percent = (part: number): string => `${whole(part)} %`;

/** The federate that waits least is the one for which the others wait; none where all wait most of their time. */
export function heldUpBy(federates: FederateWork[]): FederateWork | undefined {
  const busy = federates.filter((one) => total(one) > 0);
  const share = (one: FederateWork): number => one.wait / total(one);
  const least = busy.reduce<FederateWork | undefined>((found, one) => (!found || share(one) < share(found) ? one : found), undefined);
  return least && busy.length > 1 && share(least) < IDLE_SHARE ? least : undefined;
}

function row(list: HTMLElement, i: number): { row: Element; name: Element; bar: Element; text: Element } {
  let at = list.children[i];
  if (!at) {
    at = document.createElement("li");
    const bar = document.createElement("span");
    bar.className = "shares";
    for (const part of ["step", "exchange", "wait"]) bar.append(Object.assign(document.createElement("i"), { className: part }));
    at.append(Object.assign(document.createElement("span"), { className: "who" }), bar, Object.assign(document.createElement("small"), {}));
    list.append(at);
  }
  return { row: at, name: at.children[0]!, bar: at.children[1]!, text: at.children[2]! };
}

export function showWork(work: WorkText | undefined): void {
  const federates = work?.federates ?? [];
  const cost = work?.cost ?? [];
  element("work").hidden = federates.length === 0 && cost.length === 0;
  if (!work || element("work").hidden) return;
  const list = element("federates");
  const sum = cost.reduce((all, one) => all + one.ns, 0);
  const rows = federates.length > 0 ? federates : cost.map(({ name, ns }): FederateWork => ({ name, step: ns, exchange: 0, wait: sum - ns }));
  while (list.children.length > rows.length) list.lastElementChild!.remove();
  const slow = federates.length > 0 ? heldUpBy(federates) : undefined;
  rows.forEach((one, i) => {
    const all = total(one) || 1;
    const at = row(list, i);
    at.name.textContent = one.name;
    (["step", "exchange", "wait"] as const).forEach((part, k) => ((at.bar.children[k] as HTMLElement).style.width = `${(100 * one[part]) / all}%`));
    at.text.textContent = federates.length > 0
      ? `computes ${whole(one.step / all)}, exchanges ${whole(one.exchange / all)}, waits ${whole(one.wait / all)} %`
      : `${one.step.toFixed(0)} ns per robot and tick, ${percent(one.step / all)}`;
    at.row.classList.toggle("slow", one === slow);
  });
  const verdict = federates.length === 0 ? "All engines share one process." :
    slow ? `${slow.name} holds up the others: it waits for ${percent(slow.wait / total(slow))} of its time.`
         : work.live ? "Nobody holds up the run: all federates wait most of their time."
                     : "Nobody held up the run: all federates waited most of their time.";
  setText("work-verdict", verdict);
  const costOfAll = cost.map(({ name, ns }) => `${name} ${ns.toFixed(0)}`).join(", ");
  setText("work-cost", federates.length > 0 && sum > 0 ? `CPU time per robot and tick: ${sum.toFixed(0)} ns (${costOfAll}).` : "");
  setText("work-span", federates.length === 0 ? "whole run" : work.live ? "last seconds" : "whole run");
}
