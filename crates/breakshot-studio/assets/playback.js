/** A time that is played at a pace, stepped, and moved from impact to impact; and its keys. */

/** A step where there are no frames: that of a film of sixty pictures a second. */
const STEP_S = 1 / 60;
/** Times that differ by less are equal (s). */
const SAME_S = 1e-9;
const LARGE_STEP = 10;

/** The impacts and other events in words, those of one instant together. */
export function moments(events) {
  const verbs = { impact: " hits ", fallen: " falls off the table", entered: " enters " };
  const found = [];
  for (const event of events) {
    const words = event.kind === "fallen" ? event.bodies[0] + verbs.fallen : event.bodies.join(verbs[event.kind] ?? " and ");
    const last = found.at(-1);
    if (last && event.time_s - last.time < SAME_S) {
      if (!last.words.includes(words)) last.words.push(words);
    } else found.push({ time: event.time_s, words: [words] });
  }
  return found;
}

export class Playback {
  #on;
  #frames = null;
  #playing = null;
  #last = 0;
  start = 0;
  end = 0;
  time = 0;
  moments = [];

  /** `on.changed()` is called whenever another time is shown, `on.playing()` when playing begins or ends; `on.pace()` is the pace. */
  constructor(on) {
    this.#on = on;
  }

  get isPlaying() {
    return this.#playing !== null;
  }

  /** Shows another motion from `start` to `end` (s). With `frames`, a step leads from one of these times to the next. The time is kept as far as it lasts. */
  show({ start = 0, end, moments: impacts = [], frames = null }) {
    [this.start, this.end, this.moments] = [start, end, impacts];
    this.#frames = frames;
    this.go(this.time);
  }

  /** Goes to a time. */
  go(time) {
    this.time = Math.min(Math.max(time, this.start), this.end);
    this.#on.changed();
  }

  /** Goes to a time and stays there. */
  stopAt(time) {
    this.pause();
    this.go(time);
  }

  /** So many steps forth, or back. */
  step(count) {
    this.stopAt(this.#stepped(count));
  }

  #stepped(count) {
    const frames = this.#frames;
    if (!frames?.length) return this.time + count * STEP_S;
    const next = frames.findIndex((time) => time > this.time + SAME_S);
    const before = frames.findLastIndex((time) => time < this.time - SAME_S);
    const k = count > 0 ? (next < 0 ? frames.length : next) + count - 1 : before + count + 1;
    return frames[k] ?? (count > 0 ? this.end : this.start);
  }

  toggle() {
    if (this.isPlaying) this.pause();
    else this.play();
  }

  play() {
    if (this.end <= this.start) return;
    if (this.time >= this.end - SAME_S) this.go(this.start);
    this.#last = performance.now();
    const picture = (now) => {
      this.go(this.time + (this.#on.pace() * Math.max(0, now - this.#last)) / 1e3);
      this.#last = now;
      if (this.time >= this.end - SAME_S) this.pause();
      else this.#playing = requestAnimationFrame(picture);
    };
    this.#playing = requestAnimationFrame(picture);
    this.#on.playing();
  }

  pause() {
    cancelAnimationFrame(this.#playing);
    this.#playing = null;
    this.#on.playing();
  }

  /** Goes to the next impact, or back to the one before. */
  impact(direction) {
    const times = this.moments.map((moment) => moment.time);
    const next = direction > 0
      ? times.find((time) => time > this.time + SAME_S) ?? this.end
      : times.findLast((time) => time < this.time - SAME_S) ?? this.start;
    this.stopAt(next);
  }

  /** The last impact so far: `{ words, number, isNow }`; null before the first. */
  get lastImpact() {
    const index = this.moments.findLastIndex(({ time }) => time <= this.time + SAME_S);
    if (index < 0) return null;
    const { time, words } = this.moments[index];
    return { words: words.join(", "), number: index + 1, isNow: this.time - time < STEP_S / 2 };
  }
}

/** The keys of a player, as in Kinovea: `of(event)` is the playback that is meant, `pace(by, event)` takes the next slower pace or the one before. */
export function playbackKeys(of, pace) {
  const key = (names, words, act) => [names, words, (_, event) => act(of(event))];
  return [
    key(["Space"], "play or pause", (playback) => playback.toggle()),
    key(["ArrowLeft"], "one step back", (playback) => playback.step(-1)),
    key(["ArrowRight"], "one step forth", (playback) => playback.step(1)),
    key(["PageUp"], "ten steps back", (playback) => playback.step(-LARGE_STEP)),
    key(["PageDown"], "ten steps forth", (playback) => playback.step(LARGE_STEP)),
    key(["Ctrl+ArrowLeft"], "to the impact before", (playback) => playback.impact(-1)),
    key(["Ctrl+ArrowRight"], "to the next impact", (playback) => playback.impact(1)),
    key(["Home"], "to the start", (playback) => playback.stopAt(-Infinity)),
    key(["End"], "to the end", (playback) => playback.stopAt(Infinity)),
    [["ArrowUp"], "faster", (_, event) => pace(-1, event)],
    [["ArrowDown"], "slower", (_, event) => pace(1, event)],
  ];
}

/** Takes the next choice of a list of paces, or the one before. */
export function changePace(select, by) {
  select.selectedIndex = Math.min(Math.max(select.selectedIndex + by, 0), select.options.length - 1);
}
