/** Outlines of objects as paths of a drawing. */

import { degrees } from "/elements.js";

function corners(shape) {
  if (shape.polygon) return shape.polygon.points_m;
  const [x, y] = shape.rectangle.size_m.map((side) => side / 2);
  return [[-x, -y], [x, -y], [x, y], [-x, y]];
}

/** The largest distance of an outline from its centre (m). */
export function radius(shape) {
  if (shape.disc) return shape.disc.radius_m;
  return Math.max(...corners(shape).map(([x, y]) => Math.hypot(x, y)));
}

/** An outline as the `d` of a path, at a scale (px/m) and with its centre at a point of the object's frame (m). */
export function outline(shape, scale, [u, v] = [0, 0]) {
  const px = (x, y) => `${(x * scale).toFixed(2)} ${(-y * scale).toFixed(2)}`;
  if (shape.disc) {
    const r = shape.disc.radius_m;
    const arc = `A${(r * scale).toFixed(2)} ${(r * scale).toFixed(2)} 0 1 0`;
    return `M${px(u + r, v)}${arc} ${px(u - r, v)}${arc} ${px(u + r, v)}Z`;
  }
  return `M${corners(shape).map(([x, y]) => px(u + x, v + y)).join("L")}Z`;
}

/** The `transform` that puts an outline at a place of the drawing (px) with a yaw (rad). */
export const placed = ([x, y], yaw) => `translate(${x.toFixed(2)} ${y.toFixed(2)}) rotate(${(-degrees(yaw)).toFixed(3)})`;
