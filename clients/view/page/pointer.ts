// Wheel, drag, pinch and click on the picture.
import type { Camera } from "./camera.ts";

const CLICK_PX = 4;

export interface PointerListener {
  moved(): void;
  dragged(): void;
  clicked(px: number, py: number): void;
  /** Whether the pointer takes something, which then moves in place of the picture. */
  takes(px: number, py: number, withShift: boolean): boolean;
  carried(px: number, py: number): void;
  dropped(moved: boolean): void;
}

export function listenToPointer(canvas: HTMLCanvasElement, camera: Camera, listener: PointerListener): void {
  const down = new Map<number, [number, number]>();
  let travelled = 0;
  let carries = false;

  const place = (event: MouseEvent): [number, number] => {
    const box = canvas.getBoundingClientRect();
    return [event.clientX - box.left, event.clientY - box.top];
  };
  const spread = (): number => {
    const [a, b] = [...down.values()];
    return a && b ? Math.hypot(a[0] - b[0], a[1] - b[1]) : 0;
  };

  canvas.addEventListener("wheel", (event) => {
    event.preventDefault();
    const lines = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 16 : 1;
    camera.zoomAt(...place(event), Math.exp(-event.deltaY * lines * 0.0015));
    listener.moved();
  }, { passive: false });

  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    if (down.size === 0) travelled = 0;
    down.set(event.pointerId, place(event));
    if (down.size === 1 && event.button === 0) carries = listener.takes(...place(event), event.shiftKey);
  });

  canvas.addEventListener("pointermove", (event) => {
    const from = down.get(event.pointerId);
    if (!from) return;
    const to = place(event);
    const before = spread();
    down.set(event.pointerId, to);
    travelled += Math.hypot(to[0] - from[0], to[1] - from[1]);
    if (carries) {
      if (travelled > CLICK_PX) listener.carried(...to);
      return;
    }
    if (down.size === 2 && before > 0) camera.zoomAt(...to, spread() / before);
    else if (travelled > CLICK_PX) {
      camera.pan(to[0] - from[0], to[1] - from[1]);
      canvas.classList.add("dragging");
      listener.dragged();
    }
    listener.moved();
  });

  const up = (event: PointerEvent): void => {
    if (!down.delete(event.pointerId)) return;
    canvas.classList.remove("dragging");
    if (carries) {
      carries = false;
      listener.dropped(event.type === "pointerup" && travelled > CLICK_PX);
      if (travelled > CLICK_PX) return;
    }
    if (event.type === "pointerup" && travelled <= CLICK_PX) listener.clicked(...place(event));
  };
  canvas.addEventListener("pointerup", up);
  canvas.addEventListener("pointercancel", up);
}
