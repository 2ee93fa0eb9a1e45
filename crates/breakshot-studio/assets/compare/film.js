/** The film of a comparison with the filmed and the simulated outlines on each frame. */

import { byId, svg } from "/elements.js";
import { Frames } from "/films/frames.js";
import { Newest } from "/server.js";

const ring = (points) => `M${points.map(([x, y]) => `${x} ${y}`).join("L")}Z`;

export class FilmPane {
  #frames = new Frames();
  #shown = null;
  #colour = () => "grey";
  #isOutlined = true;
  #last = 0;

  constructor(message) {
    this.showing = new Newest(({ number, direction }) => this.#frames.frame(number, direction), (frame, { number }) => this.#draw(frame, number), message.error);
  }

  /** Opens the film of a comparison, if there is one. */
  open(shown, colour) {
    this.#shown = shown;
    this.#colour = colour;
    if (!shown.film) return;
    this.#frames.open({ film: shown.film.name }, shown.frames_s.length);
    const [width, height] = shown.film.size_px;
    byId("compare-overlay").setAttribute("viewBox", `-0.5 -0.5 ${width} ${height}`);
    byId("compare-overlay").replaceChildren();
  }

  /** Shows a frame. */
  at(number, isOutlined) {
    this.#isOutlined = isOutlined;
    this.showing.want({ number, direction: number < this.#last ? -1 : 1 });
    this.#last = number;
  }

  #draw(frame, number) {
    if (!frame) return;
    const canvas = byId("compare-frame");
    const { width, height } = frame.bitmap;
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    canvas.getContext("2d", { alpha: false }).drawImage(frame.bitmap, 0, 0);
    canvas.dataset.frame = number;
    byId("compare-overlay").replaceChildren(...(this.#isOutlined ? this.#outlines(number, height) : []));
  }

  /** The outlines of one frame; filmed solid, simulated dashed. */
  #outlines(number, height) {
    const size = height / 42;
    return this.#shown.objects.flatMap(({ name, samples }) => {
      const shot = samples[number];
      if (!shot) return [];
      const { outline_px: filmed, simulated_px: simulated } = shot;
      const drawn = [];
      if (simulated.length) drawn.push(svg("path", { class: "dash-ground", d: ring(simulated) }), svg("path", { class: `simulated ${this.#colour(name)}`, d: ring(simulated) }));
      if (filmed.length) {
        const x = filmed.reduce((sum, p) => sum + p[0], 0) / filmed.length;
        const top = Math.min(...filmed.map((p) => p[1]), ...simulated.map((p) => p[1]));
        drawn.push(svg("path", { class: `found ${this.#colour(name)}`, d: ring(filmed) }), svg("text", { class: "found-name", x, y: top - size / 2, "text-anchor": "middle" }, shot.is_doubtful ? `${name} (doubtful)` : name));
      }
      return drawn;
    });
  }
}
