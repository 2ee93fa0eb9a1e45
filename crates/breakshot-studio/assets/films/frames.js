/** Frames of a film, as the server's decoder gives them; some are fetched ahead. */

/** Frames that are fetched beyond the one that is shown, and that are kept. */
const AHEAD = 3;
const MOST_KEPT = 80;

export class Frames {
  #clip = null;
  #kept = new Map();

  /** Opens a clip: `{ campaign, clip }`. */
  open(clip) {
    this.#clip = clip;
    for (const promise of this.#kept.values()) promise.then((frame) => frame?.bitmap.close(), () => {});
    this.#kept.clear();
  }

  /** Frame `number` as `{ bitmap, time }`; null after the end. */
  async frame(number, direction = 1) {
    const found = this.#fetch(number);
    const frame = await found;
    if (frame) for (let k = 1; k <= AHEAD; k += 1) if (number + k * direction >= 0) this.#fetch(number + k * direction).catch(() => {});
    return frame;
  }

  #fetch(number) {
    if (!this.#kept.has(number)) {
      this.#kept.set(number, load({ ...this.#clip, frame: number }));
      this.#forget(number);
    }
    return this.#kept.get(number);
  }

  #forget(near) {
    if (this.#kept.size <= MOST_KEPT) return;
    const farthest = [...this.#kept.keys()].reduce((a, b) => (Math.abs(a - near) > Math.abs(b - near) ? a : b));
    this.#kept.get(farthest).then((frame) => frame?.bitmap.close(), () => {});
    this.#kept.delete(farthest);
  }
}

async function load(fields) {
  const response = await fetch(`/api/frame?${new URLSearchParams(fields)}`);
  if (response.status === 404) return null;
  if (!response.ok) throw new Error((await response.json()).error);
  const bitmap = await createImageBitmap(await response.blob(), { colorSpaceConversion: "none", premultiplyAlpha: "none" });
  return { bitmap, time: Number(response.headers.get("Frame-Time")) };
}
