/** Frames of a film, as the server's decoder gives them; some are fetched ahead. */

/** Frames that are fetched beyond the one that is shown, and that are kept. */
const AHEAD = 3;
const MOST_KEPT = 80;

export class Frames {
  #clip = null;
  #kept = new Map();
  #count = 1;

  /** Opens a clip, `{ campaign, clip }`, or a film, `{ film }`; of its `count` frames some are fetched ahead. */
  open(clip, count = 1) {
    [this.#clip, this.#count] = [clip, count];
    for (const promise of this.#kept.values()) promise.then((frame) => frame?.bitmap.close(), () => {});
    this.#kept.clear();
  }

  /** Frame `number` as `{ bitmap, time }`; null after the end. */
  async frame(number, direction = 1) {
    const found = this.#fetch(number);
    const frame = await found;
    if (frame) this.#fetchAhead(number, direction);
    return frame;
  }

  #fetchAhead(number, direction) {
    for (let k = 1; k <= AHEAD; k += 1) {
      const next = number + k * direction;
      if (next >= 0 && next < this.#count) this.#fetch(next).catch(() => {});
    }
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
