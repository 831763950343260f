// The part of the arena that the picture shows. The arena's y points up, the screen's down. Screen lengths are CSS pixels.

const LEAST_PX_PER_MM = 0.002;
const MOST_PX_PER_MM = 40;

export class Camera {
  x = 0;
  y = 0;
  pxPerMm = 0.3;
  width = 1;
  height = 1;

  resize(width: number, height: number): void {
    this.width = Math.max(1, width);
    this.height = Math.max(1, height);
  }

  /** Shows a rectangle around the origin, with a margin. */
  fit(halfWidth: number, halfHeight: number): void {
    const margin = 1.06;
    this.x = this.y = 0;
    this.#setScale(Math.min(this.width / (2 * margin * halfWidth), this.height / (2 * margin * halfHeight)));
  }

  /** Zooms so that the point under the pointer stays. */
  zoomAt(px: number, py: number, factor: number): void {
    const [x, y] = this.toArena(px, py);
    this.#setScale(this.pxPerMm * factor);
    this.x = x - (px - this.width / 2) / this.pxPerMm;
    this.y = y + (py - this.height / 2) / this.pxPerMm;
  }

  pan(dxPx: number, dyPx: number): void {
    this.x -= dxPx / this.pxPerMm;
    this.y += dyPx / this.pxPerMm;
  }

  toScreen(x: number, y: number): [number, number] {
    return [this.width / 2 + (x - this.x) * this.pxPerMm, this.height / 2 - (y - this.y) * this.pxPerMm];
  }

  toArena(px: number, py: number): [number, number] {
    return [this.x + (px - this.width / 2) / this.pxPerMm, this.y - (py - this.height / 2) / this.pxPerMm];
  }

  #setScale(pxPerMm: number): void {
    this.pxPerMm = Math.min(MOST_PX_PER_MM, Math.max(LEAST_PX_PER_MM, pxPerMm));
  }
}
