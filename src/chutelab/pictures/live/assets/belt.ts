// The incoming belt: where it runs, and what lies on it.
import { RADIANS, sinCos } from "./trig.ts";
import type { Scene } from "./scene.ts";

/** Returns the direction in which the incoming belt runs, cosine and sine. */
export function upBelt(scene: Scene): [number, number] {
  if (!scene.incoming?.incline_deg) return [1.0, 0.0];
  const [sine, cosine] = sinCos(scene.incoming.incline_deg * RADIANS);
  return [cosine, sine];
}

/** How near to the belt's height a release counts as lying on the belt, m. */
export const ON_BELT = 1e-9;

/**
 * Tells whether a stream is released on the incoming belt.
 * @param number of the stream
 */
export function onBelt(scene: Scene, number: number) {
  const stream = scene.streams[number];
  const belt = scene.incoming;
  if (belt === null || stream.fill !== undefined || stream.to !== undefined) return false;
  if (stream.at === undefined) return true;
  const riding = belt.pulley_radius + scene.particles[scene.kinds[number]].radius;
  const [x, y] = stream.at;
  const [sine, cosine] = sinCos(belt.incline_deg * RADIANS);
  const along = x * cosine + y * sine;
  const above = y * cosine - x * sine;
  return -belt.length <= along && along <= 0.0 && Math.abs(above - riding) <= ON_BELT;
}
