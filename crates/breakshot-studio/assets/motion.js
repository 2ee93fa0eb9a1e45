/** Poses and paths of a simulated motion. The segments are those of `trajectory.json`: polynomials, evaluated as the library does. */

const at = (coefficients, time) => coefficients.reduceRight((sum, c) => sum * time + c, 0);

function posedAt(segment, time) {
  const t = Math.min(Math.max(time, segment.start_s), segment.end_s) - segment.start_s;
  return [at(segment.x_m, t), at(segment.y_m, t), at(segment.yaw_rad, t)];
}

/** The pose `[x, y, yaw]` of a body at a time; null for an unknown one. */
export function pose(trajectory, name, time) {
  const segments = trajectory.motions[name];
  if (!segments?.length) return trajectory.final[name] ?? null;
  let next = 0;
  let end = segments.length;
  while (next < end) {
    const middle = (next + end) >> 1;
    if (segments[middle].start_s <= time) next = middle + 1;
    else end = middle;
  }
  const segment = segments[Math.max(next - 1, 0)];
  if (time <= segment.end_s || next < segments.length) return posedAt(segment, time);
  return trajectory.final[name] ?? posedAt(segment, time);
}

/** Points along the path of a body's centre. */
export function path(trajectory, name, most = 400) {
  const segments = (trajectory.motions[name] ?? []).filter((s) => s.end_s > s.start_s);
  const pieces = Math.max(1, Math.min(12, Math.floor(most / Math.max(1, segments.length))));
  const points = [];
  for (const segment of segments) {
    for (let k = 0; k <= pieces; k += 1) {
      const [x, y] = posedAt(segment, segment.start_s + ((segment.end_s - segment.start_s) * k) / pieces);
      const last = points.at(-1);
      if (!last || Math.hypot(x - last[0], y - last[1]) > 2e-4) points.push([x, y]);
    }
  }
  return points;
}
